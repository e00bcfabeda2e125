#include "photocoag/rt/shared_eye.hpp"

#include <bit>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {

SharedEyeDevice::SharedEyeDevice(SharedEyeMemory& memory, double period)
    : memory_(memory),
      period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)),
      first_(memory.sequence.load(std::memory_order_acquire)) {
  if (memory_.owned.exchange(1, std::memory_order_acq_rel) != 0) {
    throw Error(ErrorParts{.where = "eye",
                           .problem = "another controller is attached",
                           .found = "a second one",
                           .accepted = "one controller at a time"});
  }
}

SharedEyeDevice::~SharedEyeDevice() {
  memory_.command.store(0.0, std::memory_order_relaxed);
  memory_.token.fetch_add(1, std::memory_order_release);
  memory_.owned.store(0, std::memory_order_release);
}

bool SharedEyeDevice::read(Published& published) const noexcept {
  // The eye writes for some nanoseconds once a period: a few tries are plenty.
  for (int attempt = 0; attempt < 8; ++attempt) {
    const std::uint64_t before = memory_.version.load(std::memory_order_acquire);
    published = {.sequence = memory_.sequence.load(std::memory_order_acquire),
                 .time_ns = memory_.time_ns.load(std::memory_order_acquire),
                 .volume_temperature = memory_.volume_temperature.load(std::memory_order_acquire),
                 .emitted = memory_.emitted.load(std::memory_order_acquire)};
    if (before % 2 == 0 && memory_.version.load(std::memory_order_acquire) == before) return true;
  }
  return false;
}

DeviceSample SharedEyeDevice::wait_sample(std::uint64_t) noexcept {
  constexpr std::int64_t kLook = 20'000;  // ns
  const std::uint64_t wanted = first_ + delivered_ + 1;
  const std::int64_t start = monotonic_ns();
  const std::int64_t deadline = start + period_ns_ * 3 / 2;
  Published published;
  DeviceSample sample;
  for (std::int64_t now = start; now < deadline; now = monotonic_ns()) {
    if (read(published) && published.sequence >= wanted) {
      const std::uint64_t behind = published.sequence - wanted;
      sample.status = DeviceStatus::kGood;
      sample.sequence = ++delivered_;
      sample.periods_behind =
          behind < 1'000'000 ? static_cast<std::uint32_t>(behind) : std::uint32_t{1'000'000};
      sample.time_ns = published.time_ns;
      sample.now_ns = now;
      if (behind == 0) sample.volume_temperature = published.volume_temperature;
      sample.raw = std::bit_cast<std::int64_t>(published.volume_temperature);
      readback_ = {.power = published.emitted,  // of the latest period
                   .interlock_closed = memory_.interlock_open.load(std::memory_order_relaxed) == 0,
                   .shutter_open = true,
                   .foot_switch = true};
      return sample;
    }
    wait_until(now + kLook);
  }
  readback_.power = std::numeric_limits<double>::quiet_NaN();
  sample.status = DeviceStatus::kTimeout;
  sample.now_ns = monotonic_ns();
  return sample;
}

DeviceStatus SharedEyeDevice::write_power(double power, std::uint64_t) noexcept {
  memory_.command.store(power, std::memory_order_relaxed);
  memory_.token.fetch_add(1, std::memory_order_release);
  return DeviceStatus::kGood;
}

void SharedEyeDevice::safe_off() noexcept {
  memory_.interlock_open.store(1, std::memory_order_relaxed);
  memory_.command.store(0.0, std::memory_order_relaxed);
  memory_.token.fetch_add(1, std::memory_order_release);
}

}  // namespace photocoag
