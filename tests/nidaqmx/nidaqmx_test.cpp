// The NI-DAQmx driver, the module as it is shipped, against a stand-in for the vendor's library.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "nidaqmx/fake_nidaqmx.hpp"
#include "photocoag/device/driver.h"
#include "photocoag/rt/clock.hpp"

namespace photocoag::testing {
namespace {

constexpr const char* kScales = "K_per_V=10 W_per_V=0.02 monitor_W_per_V=0.02";

std::string settings(const std::string& more = kScales) {
  return std::string("library=") + PHOTOCOAG_FAKE_NIDAQMX + " " + more;
}

template <typename F>
F in_library(const char* library, const char* name) {
  void* handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  EXPECT_NE(handle, nullptr) << dlerror();
  return reinterpret_cast<F>(dlsym(handle, name));
}

FakeDaq& daq() {
  static auto* const get = in_library<FakeDaq* (*)()>(PHOTOCOAG_FAKE_NIDAQMX, "fake_daq");
  return *get();
}

/// The driver, open and armed for 1 ms.
struct Driver {
  explicit Driver(const std::string& text = settings()) {
    daq() = {};
    char message[300] = "";
    status = table->open(&device, text.c_str(), message, sizeof(message));
    said = message;
    if (status == PHOTOCOAG_GOOD) table->arm(device, 1'000'000);
  }
  ~Driver() {
    if (status == PHOTOCOAG_GOOD) table->close(device);
    EXPECT_EQ(daq().tasks, 0) << "every task is cleared";
    EXPECT_EQ(daq().power_V, 0.0);
  }
  photocoag_sample sample(int expected = PHOTOCOAG_GOOD) {
    photocoag_sample s{};
    EXPECT_EQ(table->wait_sample(device, monotonic_ns() + 50'000'000, &s), expected);
    return s;
  }
  const photocoag_driver_table* table =
      in_library<const photocoag_driver_table* (*)()>(PHOTOCOAG_NIDAQMX, "photocoag_driver")();
  void* device = nullptr;
  int status = PHOTOCOAG_GONE;
  std::string said;
};

TEST(NidaqmxDriver, AsksForTheChannelsAndScalesWhatItReadsAndWrites) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  EXPECT_STREQ(daq().channels[0], "Dev1/ai0,Dev1/ai1");
  EXPECT_STREQ(daq().channels[1], "Dev1/ao0");
  EXPECT_STREQ(daq().channels[2], "Dev1/port0/line0,Dev1/port0/line1,Dev1/port0/line2");
  EXPECT_STREQ(daq().channels[3], "Dev1/port0/line3,Dev1/port0/line4");
  EXPECT_EQ(daq().power_V, 0.0) << "0 W from the start";
  EXPECT_EQ(daq().relay, 1);
  daq().temperature_V = 1.5;
  const photocoag_sample first = d.sample();
  EXPECT_DOUBLE_EQ(first.volume_temperature, 15.0);
  EXPECT_EQ(first.raw, 1'500'000);
  EXPECT_EQ(first.sequence, 1u);
  EXPECT_EQ(first.saturated, 0);
  EXPECT_EQ(d.table->write_power(d.device, 0.05, 1), PHOTOCOAG_GOOD);
  EXPECT_DOUBLE_EQ(daq().power_V, 2.5);
  photocoag_readback r{};
  EXPECT_EQ(d.table->readback(d.device, &r), PHOTOCOAG_GOOD);
  EXPECT_DOUBLE_EQ(r.power, 0.05);
  EXPECT_TRUE(std::isnan(r.command)) << "no such word from the device";
  EXPECT_EQ(r.interlock_closed + r.shutter_open + r.foot_switch, 3);
  daq().foot = 0;
  d.table->readback(d.device, &r);
  EXPECT_EQ(r.foot_switch, 0);
}

TEST(NidaqmxDriver, TokensRailsAndTheLineForTheWatchdog) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 5), PHOTOCOAG_GOOD);
  EXPECT_EQ(daq().alive, 1);
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 5), PHOTOCOAG_TIMEOUT) << "an old token";
  EXPECT_EQ(daq().alive, 1);
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 6), PHOTOCOAG_GOOD);
  EXPECT_EQ(daq().alive, 0);
  EXPECT_EQ(d.table->write_power(d.device, 1.5, 7), PHOTOCOAG_GONE) << "milliwatts?";
  EXPECT_EQ(d.table->write_power(d.device, 0.5, 8), PHOTOCOAG_GONE) << "25 V of 10";
  daq().temperature_V = -10.0;
  EXPECT_EQ(d.sample().saturated, 1);
  for (int k = 0; k < 4; ++k) d.sample();
  EXPECT_EQ(daq().power_V, 0.0) << "no token for two periods";
}

TEST(NidaqmxDriver, SafeOffOpensTheRelayForGood) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  d.table->write_power(d.device, 0.05, 1);
  d.table->safe_off(d.device);
  EXPECT_EQ(daq().relay, 0);
  EXPECT_EQ(daq().power_V, 0.0);
  EXPECT_EQ(d.table->write_power(d.device, 0.05, 2), PHOTOCOAG_GOOD);
  EXPECT_EQ(daq().relay, 0);
  EXPECT_EQ(daq().power_V, 0.0);
}

TEST(NidaqmxDriver, NoCallWaitsLongerThanHalfAPeriodAndAVanishedDeviceIsGone) {
  Driver d;
  ASSERT_EQ(d.status, PHOTOCOAG_GOOD) << d.said;
  daq().patience = 0.0;
  photocoag_readback r{};
  d.sample();
  d.table->write_power(d.device, 0.01, 1);
  d.table->readback(d.device, &r);
  EXPECT_DOUBLE_EQ(daq().patience, 0.5e-3);
  d.table->write_power(d.device, 0.0, 2);
  daq().gone = true;
  d.sample(PHOTOCOAG_GONE);
  EXPECT_EQ(d.table->readback(d.device, &r), PHOTOCOAG_GONE);
  EXPECT_EQ(d.table->write_power(d.device, 0.01, 3), PHOTOCOAG_GONE);
}

TEST(NidaqmxDriver, WhatCannotBeIsRefusedByName) {
  const std::string absent = std::string("library=/nonexistent/libnidaqmx.so ") + kScales;
  const std::string other = std::string("library=libm.so.6 ") + kScales;
  const std::string scales = kScales;
  for (const auto& [text, word] :
       {std::pair{settings("K_per_V=10"), "W_per_V"},
        std::pair{settings(scales + " colour=red"), "colour"},
        std::pair{settings("K_per_V=nan W_per_V=0.02 monitor_W_per_V=0.02"), "K_per_V"},
        std::pair{settings(scales + " device=Dev7"), "Dev7: Device identifier is invalid."},
        std::pair{absent, "/nonexistent/libnidaqmx.so"},
        std::pair{other, "libm.so.6 has no DAQmxCreateTask"}}) {
    const Driver d(text);
    EXPECT_NE(d.status, PHOTOCOAG_GOOD) << text;
    EXPECT_NE(d.said.find(word), std::string::npos) << d.said;
  }
}

}  // namespace
}  // namespace photocoag::testing
