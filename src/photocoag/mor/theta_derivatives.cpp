#include "photocoag/mor/theta_derivatives.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// j (j - 1) … (j - n + 1)
double falling_factorial(int j, int n) {
  double product = 1.0;
  for (int i = 0; i < n; ++i) product *= j - i;
  return product;
}

// T_j^(n)(x), j = 0 … terms - 1, by the n-th derivative of the three-term recurrence.
VectorXd chebyshev_derivative(int terms, int n, double x) {
  MatrixXd T = MatrixXd::Zero(std::max(terms, 2), n + 1);
  T(0, 0) = 1.0;
  T(1, 0) = x;
  if (n >= 1) T(1, 1) = 1.0;
  for (int j = 2; j < terms; ++j) {
    for (int m = 0; m <= n; ++m) {
      const double lower = m > 0 ? 2.0 * m * T(j - 1, m - 1) : 0.0;
      T(j, m) = lower + 2.0 * x * T(j - 1, m) - T(j - 2, m);
    }
  }
  return T.col(n).head(terms);
}

// Largest |T_j^(n)| on [-1, 1], taken at 1: prod_{m < n} (j^2 - m^2) / (2 m + 1).
double chebyshev_bound(int j, int n) {
  double product = 1.0;
  for (int m = 0; m < n; ++m) product *= (double(j) * j - double(m) * m) / (2.0 * m + 1.0);
  return std::max(product, 0.0);
}

}  // namespace

VectorXd theta_derivative(const Theta& theta, int n, double alpha) {
  const double x = (alpha - theta.center) / theta.half_width;
  if (theta.kind == ThetaKind::kChebyshev) {
    return chebyshev_derivative(theta.terms, n, x) / std::pow(theta.half_width, n);
  }
  VectorXd result(theta.terms);
  for (int j = 0; j < theta.terms; ++j) {
    if (theta.kind == ThetaKind::kDeim) {
      result[j] = derivative(theta.points[j], n, alpha);
    } else {
      result[j] = n > j ? 0.0 : falling_factorial(j, n) * std::pow(x, j - n);
    }
  }
  return result;
}

VectorXd theta_derivative_bound(const Theta& theta, int n, double low, double high) {
  const double farthest =
      std::max(std::abs(low - theta.center), std::abs(high - theta.center)) / theta.half_width;
  if (theta.kind == ThetaKind::kChebyshev && farthest > 1.0 + 1e-12) {
    throw Error("Chebyshev polynomials are bounded on their own interval only");
  }
  VectorXd result(theta.terms);
  for (int j = 0; j < theta.terms; ++j) {
    if (theta.kind == ThetaKind::kDeim) {
      result[j] = derivative_bound(theta.points[j], n, low, high);
    } else if (theta.kind == ThetaKind::kChebyshev) {
      result[j] = chebyshev_bound(j, n) / std::pow(theta.half_width, n);
    } else {
      result[j] = n > j ? 0.0 : falling_factorial(j, n) * std::pow(farthest, j - n);
    }
  }
  return result;
}

}  // namespace photocoag
