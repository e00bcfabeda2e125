// The words about a self-test and the supervisor's judgement of it are about the same limits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "photocoag/run/device_self_test.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNoise = 0.288;  // K

SafetyLimits limits_of(double noise) {
  SafetyLimits limits;
  limits.noise = noise;
  limits.check_quiet = noise > 0.0 ? 1 : 0;
  return limits;
}

bool accepted(const SelfTestReport& report, const SafetyLimits& limits) {
  Supervisor supervisor(limits, ObserverModel{});
  supervisor.power_on();
  return supervisor.finish_self_test(report);
}

/// Cold, and its first sample comes after the first wait has given up.
struct SlowToBegin {
  int waits = 0;
  std::uint64_t sequence = 0;
  std::uint64_t writes = 0;
  double power = 0.0;

  DeviceSample wait_sample(std::uint64_t) noexcept {
    if (++waits == 1) return {.status = DeviceStatus::kTimeout};
    DeviceSample sample;
    sample.status = DeviceStatus::kGood;
    sample.volume_temperature = 0.0;
    sample.sequence = ++sequence;
    return sample;
  }
  Readback readback() noexcept { return {.power = power}; }
  DeviceStatus write_power(double watts, std::uint64_t) noexcept {
    power = watts;
    return DeviceStatus::kGood;
  }
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept {}
};

TEST(SelfTest, AWaitWithoutASampleIsNoSample) {
  SlowToBegin device;
  EXPECT_EQ(self_test(device, ControlSettings{}, true).samples, 64);
  EXPECT_EQ(static_cast<std::uint64_t>(device.waits), device.sequence + 1);
}

/// Healthy, with switches that somebody may operate at a cycle.
struct Switched : SlowToBegin {
  Readback switches;
  std::uint64_t from = 0;
  double most = 0.0;

  Readback readback() noexcept {
    Readback now = sequence > from ? switches : Readback{};
    now.power = now.interlock_closed && now.shutter_open && now.foot_switch ? power : 0.0;
    return now;
  }
  DeviceStatus write_power(double watts, std::uint64_t token) noexcept {
    most = std::max(most, watts);
    return SlowToBegin::write_power(watts, token);
  }
};

TEST(SelfTest, NoLightIsAskedForWithAnOpenSwitch) {
  for (const Readback& open : {Readback{.interlock_closed = false}, Readback{.shutter_open = false},
                               Readback{.foot_switch = false}}) {
    Switched device;
    device.switches = open;
    const SelfTestReport report = self_test(device, ControlSettings{}, true);
    EXPECT_EQ(device.most, 0.0);
    EXPECT_EQ(report.interlock_closed, open.interlock_closed);
    EXPECT_EQ(report.shutter_open, open.shutter_open);
    EXPECT_EQ(report.foot_switch, open.foot_switch);
    EXPECT_FALSE(report.switches_ready());
  }
  Switched ready;
  EXPECT_TRUE(self_test(ready, ControlSettings{}, true).switches_ready());
  EXPECT_EQ(ready.most, 1e-3);
}

// Light was seen, and before the loop could begin the foot is gone.
TEST(SelfTest, ASwitchThatOpensWhileTheEyeCoolsIsNoticed) {
  Switched whole;
  self_test(whole, ControlSettings{}, true);
  Switched device;
  device.switches = {.foot_switch = false};
  device.from = whole.sequence - 1;
  const SelfTestReport report = self_test(device, ControlSettings{}, true);
  EXPECT_EQ(device.most, 1e-3);
  EXPECT_FALSE(report.foot_switch);
}

TEST(SelfTest, SaysWhichItemFailedAndWhatToDo) {
  struct Case {
    const char* item;
    std::function<void(SelfTestReport&)> spoil;
  };
  const double nan = std::nan("");
  for (const Case& one : std::initializer_list<Case>{
           {"samples: 27", [](SelfTestReport& r) { r.samples = 27; }},
           {"samples: 31", [](SelfTestReport& r) { r.samples = 31; }},
           {"mean", [](SelfTestReport& r) { r.mean = 0.19; }},
           {"mean", [&](SelfTestReport& r) { r.mean = nan; }},
           {"noise", [](SelfTestReport& r) { r.sigma = 2.01 * kNoise; }},
           {"noise", [](SelfTestReport& r) { r.sigma = 0.49 * kNoise; }},
           {"power", [](SelfTestReport& r) { r.power_at_zero = 2.1e-3; }},
           {"switches: the device reports its interlock open,",
            [](SelfTestReport& r) { r.interlock_closed = false; }},
           {"switches: the device reports its shutter closed, its foot switch released,",
            [](SelfTestReport& r) { r.shutter_open = r.foot_switch = r.watchdog_tripped = false; }},
           {"watchdog", [](SelfTestReport& r) { r.watchdog_tripped = false; }},
           {"model", [](SelfTestReport& r) { r.model_matches = false; }},
           {"solver", [](SelfTestReport& r) { r.solver_exact = false; }},
           {"log", [](SelfTestReport& r) { r.log_has_room = false; }}}) {
    SelfTestReport report = passed_self_test(kNoise);
    const SafetyLimits limits = limits_of(kNoise);
    EXPECT_TRUE(accepted(report, limits));
    EXPECT_TRUE(failed_items(report, limits).empty());
    one.spoil(report);
    EXPECT_FALSE(accepted(report, limits)) << one.item;
    const std::vector<std::string> failed = failed_items(report, limits);
    ASSERT_FALSE(failed.empty()) << one.item;
    EXPECT_TRUE(failed.front().starts_with(one.item)) << failed.front();
    EXPECT_NE(failed.front().find(';'), std::string::npos) << "what to do: " << failed.front();
  }
}

TEST(SelfTest, TheWordsKnowTheSupervisorsLimits) {
  for (const double noise : {0.0, 0.05, kNoise}) {
    for (double mean = -0.4; mean < 0.4; mean += 0.011) {
      for (double sigma = 0.0; sigma < 0.7; sigma += 0.013) {
        SelfTestReport report = passed_self_test(noise);
        report.mean = mean;
        report.sigma = sigma;
        EXPECT_EQ(accepted(report, limits_of(noise)),
                  failed_items(report, limits_of(noise)).empty())
            << noise << " " << mean << " " << sigma;
      }
    }
  }
}

// The samples' zero is the mean of a few cold pulses: its error is in every sample.
TEST(SelfTest, AFewColdPulsesWidenTheMeansBound) {
  SafetyLimits limits = limits_of(kNoise);
  SelfTestReport report = passed_self_test(kNoise);
  report.mean = 0.27;
  EXPECT_FALSE(accepted(report, limits));
  limits.zero_error = kNoise * std::sqrt(8.0 / 16.0);
  EXPECT_TRUE(accepted(report, limits));
  EXPECT_TRUE(failed_items(report, limits).empty());
  report.mean = 1.1;
  EXPECT_FALSE(accepted(report, limits));
}

}  // namespace
}  // namespace photocoag::testing
