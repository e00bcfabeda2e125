// Role: setup and online; the supervisor's limits, and a guarded copy that detects flipped bits.
// Used by safety. Source: docs/safety.md. Units: SI; temperatures are rises over ambient.
// Real time: intact() is noexcept, no allocation.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace photocoag {

/// All limits of the supervisor. Plain data without padding (all members have eight bytes).
struct SafetyLimits {
  double period = 1e-3;          ///< s
  double power_max = 0.1;        ///< W
  double power_rise_max = 0.1;   ///< W, largest rise from one period to the next
  double peak_max = 32.0;        ///< K
  double peak_reference = 30.0;  ///< K, held by the fallback power
  double noise = 0.288;          ///< K, calibrated standard deviation of a sample
  double zero_error = 0.0;       ///< K, standard error of the samples' zero point
  double absorption_min = 0.2;   ///< of the estimator
  double absorption_max = 2.0;
  double ambient_celsius = 22.0;
  double energy_max = 6.0;              ///< J
  double exposure_max = 60.0;           ///< s with light
  double dose_max = 0.0;                ///< Arrhenius integral; 0: not limited
  double dose_log_frequency = 0.0;      ///< ln(A / (1/s))
  double dose_activation_energy = 0.0;  ///< J/mol
  double model_error = 0.01;            ///< relative, of the observer's volume temperature
  double power_accuracy = 0.0;  ///< relative: the true power may exceed the readback by this
  double gain_accuracy = 0.0;   ///< relative: the samples may lie below the truth by this
  std::int64_t overruns_in_a_row_max = 1;  ///< one more stops
  std::int64_t overruns_per_hundred = 1;   ///< one more stops
  std::int64_t command_delay = 0;          ///< periods until a written power is emitted, 0 or 1
  std::int64_t command_held =
      1;                         ///< 1: a power lasts one period longer if the next write is missed
  std::int64_t check_quiet = 1;  ///< 0: a noise-free simulated eye, no check for too little noise

  /// Factor by which the tissue may be hotter than the observer's estimate: by the readback's error
  /// before there are samples, by the samples' gain error after. The peak grows less with alpha
  /// than the volume temperature, so that both errors together are no worse.
  double hidden_gain() const noexcept {
    const double of_power = 1.0 + power_accuracy;
    const double of_samples = 1.0 / (1.0 - gain_accuracy);
    return of_power < of_samples ? of_samples : of_power;
  }
  bool operator==(const SafetyLimits&) const = default;
};
static_assert(std::is_trivially_copyable_v<SafetyLimits>);
static_assert(sizeof(SafetyLimits) % sizeof(std::uint64_t) == 0);

/// The limits with their bitwise complement beside them.
class GuardedLimits {
 public:
  explicit GuardedLimits(const SafetyLimits& limits) noexcept : limits_(limits) {
    const Words words = std::bit_cast<Words>(limits_);
    for (std::size_t i = 0; i < words.size(); ++i) complement_[i] = ~words[i];
  }
  const SafetyLimits& operator*() const noexcept { return limits_; }
  const SafetyLimits* operator->() const noexcept { return &limits_; }
  /// False after any change of a bit in either copy.
  bool intact() const noexcept {
    const Words words = std::bit_cast<Words>(limits_);
    std::uint64_t opposite =
        ~std::uint64_t{0};  // bits that differ from the complement in every word
    for (std::size_t i = 0; i < words.size(); ++i) opposite &= words[i] ^ complement_[i];
    return opposite == ~std::uint64_t{0};
  }
  /// The memory of the limits, for tests that flip bits in it.
  std::span<std::byte> memory() noexcept {
    return std::as_writable_bytes(std::span<SafetyLimits, 1>(&limits_, 1));
  }

 private:
  using Words = std::array<std::uint64_t, sizeof(SafetyLimits) / sizeof(std::uint64_t)>;
  SafetyLimits limits_;
  Words complement_{};
};

}  // namespace photocoag
