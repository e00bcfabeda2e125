// Role: after a treatment; whether what it showed fits the prior. Used by run, report.
// Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and
// Navigation, section 5.4 (chi-square tests of a filter). Difference: the posterior's mean is held
// against the prior's, in the directions that the samples tell of. Real time: no.
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
  int directions = 0;     ///< of it, that the samples tell of
  double distance_probability = 1.0;
  double innovations = 0.0;  ///< sum of innovation^2 / its variance
  double samples = 0.0;
  double innovations_probability = 1.0;

  /// Below this either test is a warning: one treatment in 500 with a right prior.
  static constexpr double kDoubtful = 1e-3;
  double probability() const noexcept {
    return std::min(distance_probability, innovations_probability);
  }
  bool doubtful() const noexcept { return probability() < kDoubtful; }
};

/// What is known of the unknowns.
struct GaussianBelief {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;  ///< positive definite
};

/// If the prior is right, theta - theta_0 has the covariance P_0 - P. A direction counts if the
/// samples have taken at least a tenth of its variance. Throws Error if sizes differ or the prior's
/// covariance is not positive definite.
PriorCheck check_prior(const GaussianBelief& prior, const GaussianBelief& posterior,
                       double innovations, double samples);

/// After the last sample; none without a prior.
std::optional<PriorCheck> prior_check_of(const AnyEstimator& estimator);

}  // namespace photocoag
