// Role: online; what an estimator did with a sample. Used by estimation, loop. Real time:
// noexcept.
#pragma once

#include <string_view>

namespace photocoag {

enum class UpdateStatus {
  kUpdated,    ///< the sample was used
  kNoSample,   ///< missing, not finite or physically impossible: prediction only
  kOutlier,    ///< too far from the prediction (outlier_gate.hpp): prediction only
  kRestarted,  ///< the estimate was not finite or its covariance invalid: back to the initial
               ///< values
};

constexpr std::string_view to_string(UpdateStatus status) noexcept {
  constexpr std::string_view names[] = {"updated", "no_sample", "outlier", "restarted"};
  return names[static_cast<std::size_t>(status)];
}

// K. Outside these bounds (frozen, or far above vaporisation) the measurement is broken: believed,
// one sample of -1e6 K would keep the laser at full power.
inline constexpr double kColdestSample = -50.0;
inline constexpr double kHottestSample = 300.0;

/// False for NaN too, which fails both comparisons.
constexpr bool possible_sample(double volume_temperature) noexcept {
  return volume_temperature >= kColdestSample && volume_temperature <= kHottestSample;
}

}  // namespace photocoag
