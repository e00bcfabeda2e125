#include "photocoag/estimation/prior_check.hpp"

#include <cmath>
#include <optional>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

constexpr int kMostTerms = 2000;
constexpr double kEnough = 1e-15;

// exp(-x) x^a / Gamma(a)
double scale_of(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

// Regularised lower incomplete gamma function by its series; x < a + 1.
double lower_gamma(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n < kMostTerms && term > kEnough * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * scale_of(a, x);
}

// The upper one by Lentz's continued fraction; x >= a + 1.
double upper_gamma(double a, double x) {
  double b = x + 1.0 - a;
  double c = 1e300;
  double d = 1.0 / b;
  double product = d;
  for (int n = 1; n < kMostTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = 1.0 / (numerator * d + b);
    c = b + numerator / c;
    product *= d * c;
    if (std::abs(d * c - 1.0) < kEnough) break;
  }
  return product * scale_of(a, x);
}

}  // namespace

double chi_square_tail(double value, double degrees) {
  const double a = 0.5 * degrees;
  const double x = 0.5 * value;
  if (!(x > 0.0)) return 1.0;
  return x < a + 1.0 ? 1.0 - lower_gamma(a, x) : upper_gamma(a, x);
}

PriorCheck check_prior(const Belief& prior, const Belief& posterior, double innovations,
                       double samples) {
  constexpr double kTold = 0.1;  // share of a direction's variance that the samples took
  const Eigen::Index size = prior.mean.size();
  if (posterior.mean.size() != size || prior.covariance.rows() != size ||
      posterior.covariance.rows() != size) {
    throw Error("prior and posterior are of different unknowns");
  }
  const std::optional<Eigen::MatrixXd> root = cholesky(prior.covariance);
  if (!root) throw Error("the prior's covariance is not positive definite");
  // In units of the prior: identity minus posterior.
  const Eigen::MatrixXd half = solve_lower(*root, posterior.covariance);
  const Eigen::MatrixXd left =
      Eigen::MatrixXd::Identity(size, size) - solve_lower(*root, Eigen::MatrixXd(half.transpose()));
  const SymmetricEigen<double> eigen = symmetric_eigen(left);
  const Eigen::VectorXd moved =
      eigen.vectors.transpose() * solve_lower(*root, Eigen::VectorXd(posterior.mean - prior.mean));
  PriorCheck check{.innovations = innovations, .samples = samples};
  for (Eigen::Index i = 0; i < size; ++i) {
    if (!(eigen.values[i] >= kTold)) continue;
    check.distance += moved[i] * moved[i] / eigen.values[i];
    ++check.directions;
  }
  if (check.directions > 0) {
    check.distance_probability = chi_square_tail(check.distance, check.directions);
  }
  if (samples > 0.0) check.innovations_probability = chi_square_tail(innovations, samples);
  return check;
}

}  // namespace photocoag
