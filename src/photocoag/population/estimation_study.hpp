// Role: offline; accuracy and consistency of the estimator: many closed-loop treatments of
// simulated eyes, statistics cycle by cycle. Used by `photocoag estimation`, tests.
// Source: consistency by NEES and NIS, Bar-Shalom, Li and Kirubarajan (2001), section 5.4;
// docs/estimation.md. Units: SI.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {

/// Eyes and disturbances of their samples.
struct EstimationScenario {
  std::string name;
  bool full_order = true;  ///< full-order eye; false: the controller's own reduced model as the eye
  /// alpha drawn from the estimator's prior (else uniformly from [0.35, 1.5]), and on a reduced eye
  /// the unknown power that the estimator expects.
  bool matched_noise = false;
  double prior_sigma = 0.0;   ///< of alpha, for the estimator too; 0: the configuration's
  bool dark = false;          ///< 0 W throughout instead of the controller's power
  double outliers = 0.0;      ///< probability that a sample is off by +-20 K
  double missing = 0.0;       ///< probability that there is no sample
  std::size_t gap_begin = 0;  ///< no samples in cycles [gap_begin, gap_end)
  std::size_t gap_end = 0;
  std::size_t bias_begin = 0;  ///< first cycle of a lasting offset of every sample
  double bias = 0.0;           ///< that offset, K
};

/// Means over all eyes at the end of one cycle; squared errors are relative to the estimator's
/// stated variance, so that 1 is consistent.
struct EstimationCycle {
  double nis = 0.0;          ///< innovation, over the available samples
  double nees = 0.0;         ///< (x, alpha) together per dimension; reduced eyes only, else 0
  double nees_alpha = 0.0;   ///< absorption factor
  double nees_peak = 0.0;    ///< peak temperature
  double rms_alpha = 0.0;    ///< root mean square of estimate / truth - 1
  double rms_peak = 0.0;     ///< K, root mean square error of the peak
  double sigma_alpha = 0.0;  ///< mean of the stated standard deviation
  double moved_alpha = 0.0;  ///< root mean square of estimate - initial value
  double rejected = 0.0;     ///< fraction of the samples rejected by the gate
  double used = 0.0;         ///< number of samples used, over all eyes
};

struct EstimationStatistics {
  EstimationScenario scenario;
  std::vector<EstimationCycle> cycles;

  /// Mean over cycles [begin, end), of squares where the field is a root mean square.
  EstimationCycle mean(std::size_t begin, std::size_t end) const;
};

/// `seeds` treatments of config.cycles() cycles. The controller is that of `config`; eyes have the
/// tissue of [plant]. Deterministic. Allocates.
EstimationStatistics estimation_statistics(const Config& config, ModelStore& models,
                                           const EstimationScenario& scenario, int seeds);

/// The scenarios that `photocoag estimation` runs.
std::vector<EstimationScenario> estimation_scenarios(const Config& config);

}  // namespace photocoag
