// Role: simulation and online; a simulated eye in another process, through shared memory: what it
// publishes, and the Device that the controller's process sees. Used by tests (process-level
// faults). Source: docs/devices.md. Real time: tick() and all calls of the device are noexcept,
// bounded and allocation-free; wait_sample blocks by design. Threads: one server, one client.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "photocoag/device/device.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {

/// Lives in memory that both processes map; zero-filled at the start. Lock-free atomics only: a
/// process that dies leaves nothing locked.
struct SharedEyeMemory {
  // Eye to controller. `version` is odd while the rest changes.
  std::atomic<std::uint64_t> version;
  std::atomic<std::uint64_t> sequence;
  std::atomic<std::int64_t> time_ns;
  std::atomic<double> volume_temperature;
  std::atomic<double> emitted;
  // Controller to eye.
  std::atomic<double> command;
  std::atomic<std::uint64_t> token;
  std::atomic<std::uint32_t> interlock_open;
  std::atomic<std::uint32_t> owned;  ///< 1: a controller is attached
};
static_assert(std::atomic<double>::is_always_lock_free);

/// The eye's side: one tick per control period, on the eye's own clock.
template <Plant P>
class SharedEyeServer {
 public:
  SharedEyeServer(SharedEyeMemory& memory, SimulatedEye<P> eye)
      : memory_(memory), eye_(std::move(eye)) {}

  /// One period: takes a fresh command if there is one, heats, publishes. Returns what was emitted,
  /// W. Without a fresh token for two periods 0 W, whatever the other process does.
  double tick() noexcept {
    const std::uint64_t token = memory_.token.load(std::memory_order_acquire);
    if (token != token_) {
      token_ = token;
      const double power = memory_.command.load(std::memory_order_relaxed);
      eye_.write(power >= 0.0 && power <= 1.0 ? power : 0.0);
    }
    if (memory_.interlock_open.load(std::memory_order_relaxed) != 0) eye_.write(0.0);
    const Reading reading = eye_.advance(sequence_++);
    memory_.version.fetch_add(1, std::memory_order_acq_rel);
    memory_.time_ns.store(monotonic_ns(), std::memory_order_relaxed);
    memory_.volume_temperature.store(reading.sample.volume_temperature, std::memory_order_relaxed);
    memory_.emitted.store(reading.sample.applied_power, std::memory_order_relaxed);
    memory_.sequence.store(sequence_, std::memory_order_relaxed);
    memory_.version.fetch_add(1, std::memory_order_acq_rel);
    truth_ = reading.truth;
    return reading.sample.applied_power;
  }
  const Outputs& truth() const noexcept { return truth_; }

 private:
  SharedEyeMemory& memory_;
  SimulatedEye<P> eye_;
  std::uint64_t token_ = 0;
  std::uint64_t sequence_ = 0;
  Outputs truth_;
};

/// The controller's side. A second controller is refused.
class SharedEyeDevice {
 public:
  /// Throws Error if another controller is attached. Starts with the next sample.
  SharedEyeDevice(SharedEyeMemory& memory, double period);
  ~SharedEyeDevice();
  SharedEyeDevice(const SharedEyeDevice&) = delete;
  SharedEyeDevice& operator=(const SharedEyeDevice&) = delete;

  /// Looks every 20 us, at most for one and a half periods.
  DeviceSample wait_sample(std::uint64_t cycle) noexcept;
  Readback readback() noexcept { return readback_; }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept;
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept;

 private:
  struct Published {
    std::uint64_t sequence = 0;
    std::int64_t time_ns = 0;
    double volume_temperature = 0.0;
    double emitted = 0.0;
  };
  bool read(Published& published) const noexcept;

  SharedEyeMemory& memory_;
  std::int64_t period_ns_;
  std::uint64_t first_;  // sequence number before the first sample
  std::uint64_t delivered_ = 0;
  Readback readback_;
};
static_assert(Device<SharedEyeDevice>);

}  // namespace photocoag
