// Role: simulation; the simulated eye as a Device, in virtual time or paced by the clock. Used by
// run, fault_table, tests. Real time: noexcept, no allocation; waits in wait_sample by design.
#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "photocoag/device/device.hpp"
#include "photocoag/loop/simulated_eye.hpp"

namespace photocoag {

/// What the wait for the end of a period brought.
struct Tick {
  std::size_t missed = 0;  ///< whole further periods that had passed by the time the loop woke up
  bool stop = false;       ///< somebody asked for the end: 0 W now
};

/// Waits for the end of cycle k = 0, 1, …; done() is told when the cycle's work is over.
template <typename P>
concept Pace = requires(P pace, std::size_t cycle) {
  { pace.wait_for_end_of(cycle) }
  noexcept->std::same_as<Tick>;
  { pace.done(cycle) }
  noexcept;
};

/// Eye and clock as one device. After a late wake-up it hands out the periods that have passed one
/// by one (periods_behind counts down); only the last one's sample is still fresh.
template <Plant P, Pace C>
class PacedEye {
 public:
  PacedEye(SimulatedEye<P>& eye, C& pace, double period)
      : eye_(eye), pace_(pace), period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)) {}

  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    if (behind_ == 0) {
      const Tick tick = pace_.wait_for_end_of(static_cast<std::size_t>(cycle));
      // Saturates at the counter's maximum.
      behind_ = static_cast<std::uint32_t>(std::min<std::size_t>(tick.missed, UINT32_MAX));
      stop_ = tick.stop;
    } else {
      --behind_;
    }
    reading_ = eye_.advance(cycle);
    DeviceSample sample;
    sample.status = DeviceStatus::kGood;
    sample.stop_asked = stop_;
    sample.periods_behind = behind_;
    if (behind_ == 0) sample.volume_temperature = reading_.sample.volume_temperature;
    sample.raw = std::bit_cast<std::int64_t>(reading_.sample.volume_temperature);
    sample.sequence = cycle + 1;
    sample.time_ns = static_cast<std::int64_t>(cycle + 1) * period_ns_;
    sample.now_ns = sample.time_ns + behind_ * period_ns_;
    if constexpr (requires { pace_.woke_ns(); }) {  // real time: when that period ended, and now
      sample.time_ns = pace_.deadline_ns(static_cast<std::size_t>(cycle));
      sample.now_ns = pace_.woke_ns();
    }
    return sample;
  }
  Readback readback() noexcept {
    return {.power = reading_.sample.applied_power,
            .interlock_closed = !off_,
            .shutter_open = true,
            .foot_switch = true};
  }
  DeviceStatus write_power(double power, std::uint64_t) noexcept {
    eye_.write(off_ ? 0.0 : power);
    return DeviceStatus::kGood;
  }
  void heartbeat(std::uint64_t cycle) noexcept { pace_.done(static_cast<std::size_t>(cycle)); }
  void safe_off() noexcept {
    off_ = true;
    eye_.write(0.0);
  }
  /// What only a simulation knows, at the end of the period that was fetched last.
  Outputs truth() const noexcept { return reading_.truth; }

 private:
  SimulatedEye<P>& eye_;
  C& pace_;
  std::int64_t period_ns_;
  std::uint32_t behind_ = 0;
  bool stop_ = false;
  bool off_ = false;
  Reading reading_;
};

}  // namespace photocoag
