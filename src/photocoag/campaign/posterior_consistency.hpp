// Role: offline; consistency and efficiency of the posterior estimate over a campaign's eyes: cycle
// by cycle against the truth, and against a batch estimate of the same record. Used by `photocoag
// campaign --estimate`. Source: Bar-Shalom, Li and Kirubarajan (2001), section 5.4 (NEES);
// docs/uncertainty.md. Units: K, s. Real time: no.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "photocoag/campaign/spot.hpp"

namespace photocoag {

/// Means over the eyes at one cycle; arrays: [0] over all, then over the terciles of alpha, lowest
/// first.
struct ConsistencyCycle {
  std::array<double, 4> nees{};     ///< of the peak: error^2 / stated variance
  std::array<double, 4> covered{};  ///< share of the eyes within 1.96 stated deviations
  double rms_K = 0.0;               ///< of the estimated peak's error
  double batch_rms_K = 0.0;         ///< of the batch estimate's; NaN: none was made at this cycle
};

/// Held peak if the whole record were known in advance: one aim, at the reference or as high as the
/// limit's quantile allows.
struct OfflineBound {
  double probability = 0.0;    ///< that the limit is exceeded, as asked for
  std::size_t over_limit = 0;  ///< eyes that exceed it
  double held_K = 0.0;         ///< mean of true peak minus reference
  double held_deviation_K = 0.0;
};

struct PosteriorConsistency {
  std::size_t eyes = 0;
  double period = 0.0;  ///< s
  std::vector<ConsistencyCycle> cycles;
  /// Over the second half, at the cycles that have both.
  double rms_K = 0.0;
  double batch_rms_K = 0.0;
  std::vector<OfflineBound> bounds;
};

/// The first `eyes` spots of the campaign. Throws Error if its controller has no posterior
/// estimator, its samples are means over pulses, or a treatment was stopped early.
PosteriorConsistency posterior_consistency(const Campaign& campaign, const SpotModels& models,
                                           std::size_t eyes,
                                           const std::function<void(double)>& progress = {});

/// A row per cycle.
std::string consistency_csv(const PosteriorConsistency& all);
/// The bounds, for `compare` (campaign/pareto.hpp).
std::string offline_bound_json(const PosteriorConsistency& all, const Campaign& campaign);

}  // namespace photocoag
