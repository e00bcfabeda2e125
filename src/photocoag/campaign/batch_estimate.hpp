// Role: offline; the maximum a posteriori estimate of the uncertain quantities from the samples of
// a whole record, one by one. Used by campaign/honesty, as a check of estimation/posterior: shares
// the model with it and nothing else. Units: SI. Real time: no.
#pragma once

#include <vector>

#include "photocoag/rom/belief.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

/// What was done and seen in a cycle.
struct RecordedCycle {
  double power = 0.0;   ///< W
  double sample = 0.0;  ///< K, at its end
};

struct BatchEstimate {
  Eigen::VectorXd log_quantities;
  Eigen::MatrixXd covariance;   ///< Laplace's
  double peak = 0.0;            ///< K, at the last cycle
  double relative_sigma = 0.0;  ///< of it, the model's rms error included
};

/// Gauss-Newton on every residual of the first `cycles` of `record`, from the prior's mean to the
/// end, within the bounds. `noise`: standard deviation of a sample, K, which is known here.
BatchEstimate batch_estimate(const UncertainModel& model, const Belief& belief,
                             const std::vector<RecordedCycle>& record, std::size_t cycles,
                             double noise);

}  // namespace photocoag
