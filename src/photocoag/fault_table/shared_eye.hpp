// Role: safety tests; the simulated eye for a controller in another process, one value per period
// through shared memory; the eye's side advances time. Used by eye_rows, tests. (The pulsed eye of
// treatments is rt/eye_device.hpp.) Source: docs/safety.md. Real time: tick() and the device's
// calls are noexcept, bounded and allocation-free. Threads: one server, one client.
#pragma once

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <limits>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/device/device.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {

/// Initially zero. Lock-free atomics only: a process that dies leaves nothing locked.
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
  std::atomic<bool> interlock_open;
  std::atomic<bool> owned;  ///< a controller is attached

  void order(double power) noexcept {
    command.store(power, std::memory_order_relaxed);
    token.fetch_add(1, std::memory_order_release);
  }
};
static_assert(std::atomic<double>::is_always_lock_free);

/// Such memory, shared with child processes.
class SharedEyeMapping {
 public:
  SharedEyeMapping()
      : memory_(mmap(nullptr, sizeof(SharedEyeMemory), PROT_READ | PROT_WRITE,
                     MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    if (memory_ == MAP_FAILED) throw Error("no shared memory");
  }
  ~SharedEyeMapping() { munmap(memory_, sizeof(SharedEyeMemory)); }
  SharedEyeMapping(const SharedEyeMapping&) = delete;
  SharedEyeMapping& operator=(const SharedEyeMapping&) = delete;
  SharedEyeMemory& operator*() const noexcept { return *static_cast<SharedEyeMemory*>(memory_); }
  SharedEyeMemory* operator->() const noexcept { return &**this; }

 private:
  void* memory_;
};

/// The eye's side: one tick per control period, on the eye's own clock.
template <Plant P>
class SharedEyeServer {
 public:
  SharedEyeServer(SharedEyeMemory& memory, SimulatedEye<P> eye)
      : memory_(memory), eye_(std::move(eye)) {}

  /// One period: takes a fresh command if there is one, heats, publishes. Returns the emitted
  /// power, W; 0 without a fresh token for two periods, whatever the other process does.
  double tick() noexcept {
    const std::uint64_t token = memory_.token.load(std::memory_order_acquire);
    if (token != token_) {
      token_ = token;
      const double power = memory_.command.load(std::memory_order_relaxed);
      eye_.write(power >= 0.0 && power <= 1.0 ? power : 0.0);
    }
    if (memory_.interlock_open.load(std::memory_order_relaxed)) eye_.write(0.0);
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
  SharedEyeDevice(SharedEyeMemory& memory, double period)
      : memory_(memory),
        period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)),
        first_(memory.sequence.load(std::memory_order_acquire)) {
    if (memory_.owned.exchange(true)) {
      throw Error(ErrorParts{.where = "eye",
                             .problem = "another controller is attached",
                             .found = "a second one",
                             .accepted = "one controller at a time"});
    }
  }
  ~SharedEyeDevice() {
    memory_.order(0.0);
    memory_.owned.store(false);
  }
  SharedEyeDevice(const SharedEyeDevice&) = delete;
  SharedEyeDevice& operator=(const SharedEyeDevice&) = delete;

  /// Polls every 20 us, for at most one and a half periods.
  DeviceSample wait_sample(std::uint64_t) noexcept {
    constexpr std::int64_t kPollNs = 20'000;  // ns
    const std::uint64_t wanted = first_ + delivered_ + 1;
    const std::int64_t deadline = monotonic_ns() + period_ns_ * 3 / 2;
    DeviceSample sample;
    for (sample.now_ns = monotonic_ns(); sample.now_ns < deadline; sample.now_ns = monotonic_ns()) {
      std::uint64_t sequence = 0;
      if (read(sample, sequence) && sequence >= wanted) {
        const std::uint64_t behind = sequence - wanted;
        sample.status = DeviceStatus::kGood;
        sample.sequence = ++delivered_;
        sample.periods_behind =
            static_cast<std::uint32_t>(std::min<std::uint64_t>(behind, 1'000'000));
        if (behind > 0) sample.volume_temperature = std::numeric_limits<double>::quiet_NaN();
        return sample;
      }
      wait_until(sample.now_ns + kPollNs);
    }
    readback_.power = std::numeric_limits<double>::quiet_NaN();
    DeviceSample none;
    none.now_ns = sample.now_ns;
    return none;
  }
  Readback readback() noexcept { return readback_; }  // of the latest period
  DeviceStatus write_power(double power, std::uint64_t) noexcept {
    memory_.order(power);
    return DeviceStatus::kGood;
  }
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept {
    memory_.interlock_open.store(true, std::memory_order_relaxed);
    memory_.order(0.0);
  }

 private:
  // The eye writes for some nanoseconds once per period: a few attempts suffice.
  bool read(DeviceSample& sample, std::uint64_t& sequence) noexcept {
    for (int attempt = 0; attempt < 8; ++attempt) {
      const std::uint64_t before = memory_.version.load(std::memory_order_acquire);
      sequence = memory_.sequence.load(std::memory_order_acquire);
      sample.time_ns = memory_.time_ns.load(std::memory_order_acquire);
      sample.volume_temperature = memory_.volume_temperature.load(std::memory_order_acquire);
      sample.raw = std::bit_cast<std::int64_t>(sample.volume_temperature);
      readback_.power = memory_.emitted.load(std::memory_order_acquire);
      readback_.interlock_closed = !memory_.interlock_open.load(std::memory_order_acquire);
      if (before % 2 == 0 && memory_.version.load(std::memory_order_acquire) == before) return true;
    }
    return false;
  }

  SharedEyeMemory& memory_;
  std::int64_t period_ns_;
  std::uint64_t first_;  // sequence number before the first sample
  std::uint64_t delivered_ = 0;
  Readback readback_;
};
static_assert(Device<SharedEyeDevice>);

}  // namespace photocoag
