// Role: online; the supervisor's check of a sample: present, fresh, within range, changing, and
// consistent with the emitted power. Used by the supervisor. Rows of the fault table
// (docs/safety.md): M1 to M9. Units: K, ns. Real time: noexcept, bounded, allocation-free.
#pragma once

#include <cstdint>
#include <limits>

#include "photocoag/device/device.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"
#include "photocoag/safety/recent.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

inline constexpr int kMissingMax = 2;     ///< in a row
inline constexpr int kSaturatedMax = 1;   ///< in a row
inline constexpr int kSameRawMax = 5;     ///< equal raw values in a row
inline constexpr int kRejectedMax = 2;    ///< among the last 20
inline constexpr double kRejectAt = 6.0;  ///< standard deviations
inline constexpr double kResidualLimit =
    36.0;  ///< cap of a squared residual: one spike is no evidence of noise

class SampleCheck {
 public:
  /// kNone: the sample may be used; otherwise the reason why not. Rejections are counted; too many
  /// stop the treatment.
  SafetyReason check(const DeviceSample& sample, MultiModelObserver& observer,
                     const SafetyLimits& limits, SafetyLatch& latch) noexcept;

 private:
  void watch_noise(double residual, SafetyLatch& latch) noexcept;
  void count(SafetyReason reason, SafetyLatch& latch) noexcept;

  std::uint64_t expected_ = 0;  // least sequence number of this cycle's sample
  std::int64_t raw_ = std::numeric_limits<std::int64_t>::min();
  int same_raw_ = 0;
  int missing_ = 0;
  int saturated_ = 0;
  RecentEvents rejected_;
  RecentSum residuals_;  // squared, in standard deviations
};

}  // namespace photocoag
