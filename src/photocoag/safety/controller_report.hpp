// Role: online; what the controller reports to the supervisor in one cycle, as plain numbers. Used
// by safety, loop. Units: SI.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace photocoag {

enum class SolveOutcome : std::uint8_t { kSolved, kInfeasible, kFailed };

struct ControllerReport {
  double command = 0.0;  ///< W
  SolveOutcome solve = SolveOutcome::kSolved;
  bool restarted = false;         ///< the estimator went back to its initial values
  bool updated = false;           ///< the estimator used this cycle's sample
  double peak = 0.0;              ///< K, estimate
  double absorption = 0.0;        ///< estimate
  double innovation = 0.0;        ///< K
  double innovation_sigma = 0.0;  ///< K
  /// W, the plan's next two powers after `command`; not finite: nothing planned.
  std::array<double, 2> plan{std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};
};

}  // namespace photocoag
