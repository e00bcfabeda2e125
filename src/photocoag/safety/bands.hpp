// Role: online; the supervisor's counts and bands, in one place. Used by safety. Source:
// docs/safety.md. Units: SI; counts in control periods.
#pragma once

#include <cstdint>

namespace photocoag {

inline constexpr int kMissingMax = 2;
inline constexpr int kSaturatedMax = 1;
inline constexpr int kSameRawMax = 5;
inline constexpr int kRejectedMax = 2;          // among the last 20
inline constexpr double kRejectAt = 6.0;        // standard deviations
inline constexpr double kResidualLimit = 36.0;  // squared: one spike is no proof of noise
// Sum of 20 squared normal numbers: below 1.9 or above 76.4 with probability 5e-8 each.
inline constexpr double kQuietest = 1.9;
inline constexpr double kNoisiest = 76.4;
inline constexpr int kFallbacksMax = 2;
inline constexpr int kInfeasibleMax = 19;
inline constexpr int kAbsorptionBadMax = 9;
inline constexpr double kAbsorptionJump = 0.3;
inline constexpr std::int64_t kAbsorptionSettled = 10;  // cycles
// Temperatures are not linear in alpha: what a linear estimator leaves of a move of alpha, as a
// share of the temperature and of the square of the relative move.
inline constexpr double kSettlingShare = 0.25;
inline constexpr double kPeakEstimateExcess = 1.0;  // K
inline constexpr int kPeakEstimatesMax = 2;
inline constexpr double kReadbackRelative = 0.2;
inline constexpr double kReadbackFloor = 2e-3;  // W
inline constexpr int kLateCommandsMax = 3;      // in a row
inline constexpr std::int64_t kNsPerSecond = 1'000'000'000;

/// Neither infinite nor NaN.
constexpr bool finite(double value) noexcept { return value - value == 0.0; }

}  // namespace photocoag
