#include "photocoag/estimation/prior_check.hpp"

#include <optional>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/special_functions.hpp"

namespace photocoag {

double chi_square_tail(double value, double degrees) {
  return value > 0.0 ? upper_gamma(0.5 * degrees, 0.5 * value) : 1.0;
}

PriorCheck check_prior(const GaussianBelief& prior, const GaussianBelief& posterior,
                       double innovations, double samples) {
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

std::optional<PriorCheck> prior_check_of(const AnyEstimator& estimator) {
  const PosteriorEstimator* posterior = estimator.posterior();
  if (posterior == nullptr) return {};
  return check_prior({posterior->prior_mean(), posterior->prior_covariance()},
                     {posterior->joint_mean(), posterior->joint_covariance()},
                     posterior->innovations(), posterior->samples());
}

}  // namespace photocoag
