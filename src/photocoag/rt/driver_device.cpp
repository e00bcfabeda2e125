#include "photocoag/rt/driver_device.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/floating_point.hpp"

namespace photocoag {
namespace {

DeviceStatus status_of(std::int32_t answer) noexcept {
  if (answer == PHOTOCOAG_GOOD) return DeviceStatus::kGood;
  return answer == PHOTOCOAG_TIMEOUT ? DeviceStatus::kTimeout : DeviceStatus::kGone;
}

bool complete(const photocoag_driver_table& table) noexcept {
  return table.name != nullptr && table.open != nullptr && table.arm != nullptr &&
         table.wait_sample != nullptr && table.write_power != nullptr &&
         table.readback != nullptr && table.heartbeat != nullptr && table.safe_off != nullptr &&
         table.close != nullptr;
}

}  // namespace

DriverDevice::DriverDevice(const std::string& library, const std::string& settings, double period,
                           bool light_allowed)
    : period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)) {
  const KeptFloatingPoint kept;  // loading runs code of the library, too
  const auto refuse = [&](std::string problem, std::string found, std::string accepted) {
    if (device_ != nullptr) table_->close(device_);
    if (library_ != nullptr) dlclose(library_);
    throw Error(ErrorParts{.where = library,
                           .key = {},
                           .problem = std::move(problem),
                           .found = std::move(found),
                           .accepted = std::move(accepted)});
  };
  library_ = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library_ == nullptr) {
    refuse("the driver cannot be loaded", dlerror(), "a shared library; docs/devices.md");
  }
  using Entry = const photocoag_driver_table* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(library_, "photocoag_driver"));
  if (entry == nullptr)
    refuse("it is no driver", "no function photocoag_driver", "docs/devices.md");
  table_ = entry();
  if (table_ == nullptr || table_->version != PHOTOCOAG_DRIVER_VERSION ||
      table_->size != sizeof(photocoag_driver_table)) {
    refuse("it is for another version of the interface",
           table_ == nullptr ? "no table" : fmt::format("version {}", table_->version),
           fmt::format("version {}", PHOTOCOAG_DRIVER_VERSION));
  }
  if (!complete(*table_)) refuse("its table has empty entries", "", "all of device/driver.h");
  if (table_->simulated != 1 && !light_allowed) {
    dlclose(library_);
    throw Error(ErrorParts{.where = library,
                           .key = "safety.real_time",
                           .problem = "light can come out of this driver's device",
                           .found = "observe, or no supervisor",
                           .accepted = "\"enforce\", with safety.supervisor = \"on\""});
  }
  std::array<char, 256> message{};
  const std::int32_t opened = table_->open(&device_, settings.c_str(), message.data(),
                                           static_cast<std::uint32_t>(message.size() - 1));
  if (opened != PHOTOCOAG_GOOD || device_ == nullptr) {
    device_ = nullptr;
    refuse("the device cannot be opened", message.data(), "a device that is present");
  }
  if (table_->arm(device_, period_ns_) != PHOTOCOAG_GOOD) {
    refuse("the device does not support the control period", fmt::format("{} ns", period_ns_),
           "one it can keep");
  }
}

DriverDevice::~DriverDevice() {
  const KeptFloatingPoint kept;
  table_->safe_off(device_);
  table_->close(device_);
  dlclose(library_);
}

void DriverDevice::begin() noexcept {
  samples_before_ = sample_;
  tokens_before_ = token_;
}

DeviceSample DriverDevice::wait_sample(std::uint64_t) noexcept {
  const KeptFloatingPoint kept;
  photocoag_sample answer{.volume_temperature = std::numeric_limits<double>::quiet_NaN(),
                          .raw = 0,
                          .sequence = 0,
                          .time_ns = 0,
                          .saturated = 0,
                          .stop_asked = 0};
  const std::int64_t deadline = monotonic_ns() + period_ns_ * 3 / 2;
  DeviceSample sample;
  sample.status = status_of(table_->wait_sample(device_, deadline, &answer));
  sample.saturated = answer.saturated != 0;
  sample.stop_asked = answer.stop_asked != 0;
  sample.volume_temperature = answer.volume_temperature;
  sample.raw = answer.raw;
  sample.sequence = answer.sequence - std::min(answer.sequence, samples_before_);
  sample.time_ns = answer.time_ns;
  sample.now_ns = monotonic_ns();
  if (sample.status == DeviceStatus::kGood) sample_ = answer.sequence;
  // A sample more than a period old is outdated: there is a newer one to fetch before any write.
  if (sample.status == DeviceStatus::kGood && sample.now_ns - sample.time_ns >= period_ns_) {
    const std::int64_t behind = (sample.now_ns - sample.time_ns) / period_ns_;
    sample.periods_behind = static_cast<std::uint32_t>(behind < 1'000'000 ? behind : 1'000'000);
  }
  return sample;
}

Readback DriverDevice::readback() noexcept {
  const KeptFloatingPoint kept;
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  photocoag_readback answer{.power = kUnknown,
                            .command = kUnknown,
                            .interlock_closed = 0,
                            .shutter_open = 0,
                            .foot_switch = 0};
  // No answer: all switches count as open.
  if (table_->readback(device_, &answer) != PHOTOCOAG_GOOD) {
    return {answer.power, kUnknown, false, false, false};
  }
  return {.power = answer.power,
          .command = answer.command,
          .interlock_closed = answer.interlock_closed == 1,
          .shutter_open = answer.shutter_open == 1,
          .foot_switch = answer.foot_switch == 1};
}

DeviceStatus DriverDevice::write_power(double power, std::uint64_t token) noexcept {
  const KeptFloatingPoint kept;
  token_ = token + tokens_before_;
  return status_of(table_->write_power(device_, power, token_));
}

void DriverDevice::heartbeat(std::uint64_t cycle) noexcept {
  const KeptFloatingPoint kept;
  table_->heartbeat(device_, cycle + samples_before_);
}

void DriverDevice::safe_off() noexcept {
  const KeptFloatingPoint kept;
  table_->safe_off(device_);
}

}  // namespace photocoag
