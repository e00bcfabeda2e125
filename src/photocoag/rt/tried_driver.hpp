// Role: offline; a driver under test: every answer is checked.
// Used by driver_promises only. Source: device/driver.h. Units: W, K, ns. Real time: none.
#pragma once

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "photocoag/device/driver.h"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/driver_promises.hpp"

namespace photocoag {

inline constexpr int kTriedPeriods = 40;  // length of a trial

/// Throws BrokenPromise with these words.
template <typename... T>
[[noreturn]] void broken(fmt::format_string<T...> format, const T&... values) {
  throw BrokenPromise{fmt::vformat(format, fmt::make_format_args(values...))};
}

/// The library's table of functions; `library` gets the handle of dlopen.
inline const photocoag_driver_table* table_of(const DriverCheckSettings& s,
                                              void** library = nullptr) {
  void* handle = dlopen(s.library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) broken("the library cannot be loaded: {}", dlerror());
  if (library != nullptr) *library = handle;
  using Entry = const photocoag_driver_table* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(handle, "photocoag_driver"));
  if (entry == nullptr) broken("there is no function photocoag_driver");
  const photocoag_driver_table* table = entry();
  if (table == nullptr) broken("photocoag_driver() returns no table");
  return table;
}

/// An open (and armed) device; each answer is checked.
class Tried {
 public:
  explicit Tried(const DriverCheckSettings& s, bool armed = true)
      : table_(table_of(s, &library_)), period_(static_cast<std::int64_t>(s.period * 1e9 + 0.5)) {
    std::array<char, 256> message{};
    const std::int32_t opened =
        table_->open(&device_, s.settings.c_str(), message.data(), message.size() - 1);
    if (known(opened, "open") != PHOTOCOAG_GOOD || device_ == nullptr) {
      throw UnopenedDevice{message.data()};
    }
    if (!armed) return;
    if (known(table_->arm(device_, period_), "arm") != PHOTOCOAG_GOOD) {
      throw UnopenedDevice{fmt::format("it does not take a control period of {} ns", period_)};
    }
  }

  static std::int32_t known(std::int32_t answer, const char* call) {
    if (answer < PHOTOCOAG_GOOD || answer > PHOTOCOAG_GONE) {
      broken("{} answers {}, which is no status", call, answer);
    }
    return answer;
  }
  photocoag_sample sample() {
    photocoag_sample sample{std::numeric_limits<double>::quiet_NaN(), 0, 0, 0, 0, 0};
    const std::int32_t answer = wait(sample, monotonic_ns() + 50 * period_);
    if (answer != PHOTOCOAG_GOOD) broken("wait_sample answers {} with 50 periods of time", answer);
    return sample;
  }
  std::int32_t wait(photocoag_sample& sample, std::int64_t deadline) {
    return known(table_->wait_sample(device_, deadline, &sample), "wait_sample");
  }
  std::int32_t write(double power, std::uint64_t token) {
    return known(table_->write_power(device_, power, token), "write_power");
  }
  std::int32_t write(double power) { return write(power, ++token_); }
  photocoag_readback readback() {
    photocoag_readback answer{std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::quiet_NaN(), -1, -1, -1};
    if (known(table_->readback(device_, &answer), "readback") != PHOTOCOAG_GOOD) {
      broken("readback does not answer");
    }
    return answer;
  }
  void heartbeat(std::uint64_t cycle) { known(table_->heartbeat(device_, cycle), "heartbeat"); }
  void safe_off() { table_->safe_off(device_); }
  void close() { table_->close(device_); }
  std::uint64_t token() const noexcept { return token_; }
  std::int64_t period() const noexcept { return period_; }
  void* library() const noexcept { return library_; }

  /// Writes `power` each period, as the loop does; returns the highest power read back.
  double emit(double power, int periods = kTriedPeriods) {
    double highest = 0.0;
    for (int k = 0; k < periods; ++k) {
      write(power);
      sample();
      highest = std::max(highest, readback().power);
    }
    return highest;
  }
  /// Calls `each` and fetches a sample until one is more than `periods` periods newer than `since`,
  /// ns; returns the power of its period, W.
  template <typename F>
  double power_after(std::int64_t since, int periods, F&& each) {
    for (int k = 0; k < 1000; ++k) {
      each();
      const photocoag_sample now = sample();
      const double power = readback().power;
      if (now.time_ns > since + periods * period_) return power;
    }
    broken("a thousand samples, and none of the last {} periods", periods);
  }

 private:
  void* library_ = nullptr;
  const photocoag_driver_table* table_;
  void* device_ = nullptr;
  std::int64_t period_;
  std::uint64_t token_ = 0;
};

}  // namespace photocoag
