// Role: after a treatment; tests whether the samples fit the prior. Used by run.
// Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and
// Navigation, section 5.4 (chi-square tests of a filter). Difference: the posterior's mean is
// tested against the prior's, in the directions that the samples inform. Real time: no.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "photocoag/estimation/estimator.hpp"

namespace photocoag {

/// Probability that a chi-square variable of `degrees` > 0 exceeds `value`.
double chi_square_tail(double value, double degrees);

/// Two tests of a prior; a probability near 0 speaks against it.
struct PriorCheck {
  double distance = 0.0;  ///< (theta - theta_0)' (P_0 - P)^-1 (theta - theta_0)
  int directions = 0;     ///< degrees of freedom: directions that the samples inform
  double distance_probability = 1.0;
  double innovations = 0.0;  ///< sum of innovation^2 / its variance
  double samples = 0.0;
  double innovations_probability = 1.0;

  /// Below this either test warns: at most one treatment in 500 if the prior is right.
  static constexpr double kDoubtful = 1e-3;
  double probability() const noexcept {
    return std::min(distance_probability, innovations_probability);
  }
  bool doubtful() const noexcept { return probability() < kDoubtful; }
};

/// A Gaussian over the unknowns.
struct GaussianBelief {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;  ///< positive definite
};

/// If the prior is right, theta - theta_0 has the covariance P_0 - P. A direction counts if the
/// samples have reduced its variance by at least a tenth. Throws Error if sizes differ or the
/// prior's covariance is not positive definite.
PriorCheck check_prior(const GaussianBelief& prior, const GaussianBelief& posterior,
                       double innovations, double samples);

/// The check after the last sample; nullopt without a prior.
std::optional<PriorCheck> prior_check_of(const AnyEstimator& estimator);

}  // namespace photocoag
