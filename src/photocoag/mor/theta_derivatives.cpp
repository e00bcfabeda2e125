#include "photocoag/mor/theta_derivatives.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"

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

VectorXd chebyshev_bounds(int terms, int n) {
  VectorXd result(terms);
  for (int j = 0; j < terms; ++j) result[j] = chebyshev_bound(j, n);
  return result;
}

// All products, those of `first` running fastest.
VectorXd products(const VectorXd& first, const VectorXd& second) {
  return (first * second.transpose()).reshaped();
}

// Largest |x| in the range, x from -1 to 1 over the interval of the polynomials.
double farthest(double low, double high, const ThetaFactor& factor) {
  return std::max(std::abs(low - factor.center), std::abs(high - factor.center)) /
         factor.half_width;
}

}  // namespace

VectorXd theta_derivative(const Theta& theta, DerivativeOrder order, AbsorptionFactors at) {
  const double x = (at.alpha - theta.factors[0].center) / theta.factors[0].half_width;
  const int n = order.alpha;
  if (theta.kind == ThetaKind::kChebyshev) {
    const double y = (at.beta - theta.factors[1].center) / theta.factors[1].half_width;
    return products(
        chebyshev_derivative(theta.terms_of(0), n, x) / std::pow(theta.factors[0].half_width, n),
        chebyshev_derivative(theta.terms_of(1), order.beta, y) /
            std::pow(theta.factors[1].half_width, order.beta));
  }
  VectorXd result(theta.terms);
  for (int j = 0; j < theta.terms; ++j) {
    if (theta.kind == ThetaKind::kDeim) {
      result[j] = derivative(theta.points[j], order, at);
    } else {
      result[j] = n > j || order.beta > 0 ? 0.0 : falling_factorial(j, n) * std::pow(x, j - n);
    }
  }
  return result;
}

VectorXd theta_derivative_bound(const Theta& theta, DerivativeOrder order,
                                const FactorRange& range) {
  const double x = farthest(range.low.alpha, range.high.alpha, theta.factors[0]);
  const int n = order.alpha;
  if (theta.kind == ThetaKind::kChebyshev) {
    const double y =
        theta.terms_of(1) == 1 ? 0.0 : farthest(range.low.beta, range.high.beta, theta.factors[1]);
    if (std::max(x, y) > 1.0 + 1e-12) {
      throw Error("Chebyshev polynomials are bounded on their own interval only");
    }
    return products(
        chebyshev_bounds(theta.terms_of(0), n) / std::pow(theta.factors[0].half_width, n),
        chebyshev_bounds(theta.terms_of(1), order.beta) /
            std::pow(theta.factors[1].half_width, order.beta));
  }
  VectorXd result(theta.terms);
  for (int j = 0; j < theta.terms; ++j) {
    if (theta.kind == ThetaKind::kDeim) {
      result[j] = derivative_bound(theta.points[j], order, range);
    } else {
      result[j] = n > j || order.beta > 0 ? 0.0 : falling_factorial(j, n) * std::pow(x, j - n);
    }
  }
  return result;
}

}  // namespace photocoag
