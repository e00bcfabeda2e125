// Role: offline; the maximum a posteriori estimate of the uncertain quantities from all individual
// samples of a record. Used by campaign/posterior_consistency, to check estimation/posterior, with
// which it shares only the model. Units: SI. Real time: no.
#pragma once

#include <vector>

#include "photocoag/rom/belief.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

/// Power and sample of a cycle.
struct SampledCycle {
  double power = 0.0;   ///< W
  double sample = 0.0;  ///< K, at its end
};

struct BatchEstimate {
  Eigen::VectorXd log_quantities;
  Eigen::MatrixXd covariance;   ///< Laplace's
  double peak = 0.0;            ///< K, at the last cycle
  double relative_sigma = 0.0;  ///< of the peak, the model's rms error included
};

/// Gauss-Newton on every residual of the first `cycles` of `record`, from the prior's mean to
/// convergence, within the bounds. `noise`: known standard deviation of a sample, K.
BatchEstimate batch_estimate(const UncertainModel& model, const Belief& belief,
                             const std::vector<SampledCycle>& record, std::size_t cycles,
                             double noise);

}  // namespace photocoag
