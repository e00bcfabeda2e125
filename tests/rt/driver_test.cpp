// Vendors' drivers: the example driver in the closed loop, and libraries that are refused.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/driver_device.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {

/// Not a treatment: the same power each cycle.
struct ConstantPower {
  double power = 0.02;
  Estimate observe(const Sample& sample) noexcept {
    last.outputs.peak = sample.volume_temperature;
    last.status = UpdateStatus::kNoSample;
    last.absorption_factor = 1.0;
    return last;
  }
  Decision decide() noexcept { return {.power = power, .status = MpcStatus::kSolved}; }
  Estimate estimate() const noexcept { return last; }
  Estimate last{};
};
inline Innovation innovation_of(const ConstantPower&) noexcept { return {0.0, 1.0}; }

namespace {

constexpr double kPeriod = 2e-3;  // s
constexpr double kGain = 600.0;   // K/W, the example's defaults
constexpr double kTau = 0.02;     // s

/// A supervisor that knows the example's lump of tissue.
Supervisor supervisor_of_the_example() {
  ObserverModel model;
  model.decay[0] = std::exp(-kPeriod / kTau);
  for (std::size_t j = 0; j < kObserverAbsorptions; ++j) {
    model.absorption[j] = 0.5 + 0.02 * static_cast<double>(j);
    model.volume[j][0] = model.absorption[j] * kGain * (1.0 - model.decay[0]);
    model.peak[j][0] = model.volume[j][0];
    model.steady_peak[j] = model.absorption[j] * kGain;
  }
  SafetyLimits limits;
  limits.period = kPeriod;
  limits.noise = 0.05;
  limits.check_quiet = 0;
  limits.overruns_in_a_row_max = 1000;  // a busy machine is no fault of the driver
  limits.overruns_per_hundred = 100;
  Supervisor supervisor(limits, model);
  supervisor.power_on();
  supervisor.finish_self_test({.samples = 64,
                               .interlock_closed = true,
                               .shutter_open = true,
                               .foot_switch = true,
                               .watchdog_tripped = true,
                               .model_matches = true,
                               .solver_exact = true,
                               .log_has_room = true});
  supervisor.ready();
  supervisor.begin(true);
  return supervisor;
}

TEST(Driver, TheExampleRunsInTheLoopWithoutAllocation) {
  DriverDevice device(PHOTOCOAG_EXAMPLE_DRIVER, "noise=0", kPeriod);
  EXPECT_TRUE(device.simulated());
  EXPECT_EQ(device.name(), "example: one time constant");
  ConstantPower controller;
  Supervisor supervisor = supervisor_of_the_example();
  std::vector<CycleRecord> records(100);
  LoopOutcome outcome;
  const HeapGuard guard;
  outcome = run_loop(controller, device, supervisor, kPeriod, std::span(records));
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
  EXPECT_EQ(outcome.cycles, 100u);
  EXPECT_FALSE(outcome.stopped) << to_string(outcome.safety.reason);
  double temperature = 0.0;
  const double keep = std::exp(-kPeriod / kTau);
  for (const CycleRecord& record : records) {
    temperature = keep * temperature + (1.0 - keep) * kGain * record.power;
    EXPECT_EQ(record.device_command, record.power) << "it says so, and it is true";
    // Held or cut by the watchdog where the machine was late; the driver says what it emitted.
    if (record.sample.usable) {
      EXPECT_NEAR(record.measured, temperature, 1e-9);
    }
  }
  EXPECT_GT(temperature, 1.0) << "it did heat, if a busy machine let it: 12 K in the end";
}

TEST(Driver, WithoutFreshTokensItsWatchdogSwitchesOff) {
  DriverDevice device(PHOTOCOAG_EXAMPLE_DRIVER, "", kPeriod);
  EXPECT_EQ(device.write_power(0.02, 1), DeviceStatus::kGood);
  for (std::uint64_t cycle = 0; cycle < 6; ++cycle) {
    const DeviceSample sample = device.wait_sample(cycle);
    EXPECT_EQ(sample.sequence, cycle + 1);
    if (cycle >= 3) {
      EXPECT_EQ(device.readback().power, 0.0) << cycle;
    }
  }
  EXPECT_NE(device.write_power(0.02, 1), DeviceStatus::kGood) << "an old token";
  EXPECT_EQ(device.write_power(0.02, 2), DeviceStatus::kGood);
}

// Numbered by the waits instead of by the driver's samples, every sample of the treatment would be
// one period old for ever.
TEST(Driver, AfterASelfTestSamplesAreCountedAnewAlsoIfAWaitBroughtNone) {
  DriverDevice device(PHOTOCOAG_RUDE_DRIVER, "slow", kPeriod);
  EXPECT_EQ(device.wait_sample(0).status, DeviceStatus::kTimeout);
  EXPECT_EQ(device.wait_sample(1).sequence, 1U);
  EXPECT_EQ(device.wait_sample(2).sequence, 2U);
  device.begin();
  EXPECT_EQ(device.wait_sample(0).sequence, 1U);
  EXPECT_EQ(device.wait_sample(1).sequence, 2U);
}

TEST(Driver, AfterASelfTestTokensAreCountedAnew) {
  DriverDevice device(PHOTOCOAG_EXAMPLE_DRIVER, "", kPeriod);
  EXPECT_EQ(device.write_power(0.0, 1), DeviceStatus::kGood);
  EXPECT_EQ(device.write_power(0.0, 2), DeviceStatus::kGood);
  EXPECT_NE(device.write_power(0.0, 1), DeviceStatus::kGood) << "an old token";
  EXPECT_EQ(device.write_power(0.0, 3), DeviceStatus::kGood);
  device.begin();
  EXPECT_EQ(device.write_power(0.0, 1), DeviceStatus::kGood);
}

TEST(Driver, SafeOffOpensTheInterlockForGood) {
  DriverDevice device(PHOTOCOAG_EXAMPLE_DRIVER, "", kPeriod);
  device.safe_off();
  EXPECT_EQ(device.write_power(0.02, 1), DeviceStatus::kGood);
  device.wait_sample(0);
  EXPECT_EQ(device.readback().power, 0.0);
  EXPECT_FALSE(device.readback().interlock_closed);
}

TEST(Driver, BadLibrariesAreRefusedByName) {
  const auto message = [](const std::string& library, const std::string& settings, double period) {
    try {
      const DriverDevice device(library, settings, period);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(message("/no/such/driver.so", "", kPeriod).find("/no/such/driver.so"),
            std::string::npos);
  EXPECT_NE(message("libm.so.6", "", kPeriod).find("photocoag_driver"), std::string::npos);
  EXPECT_NE(message(PHOTOCOAG_EXAMPLE_DRIVER, "fail=open", kPeriod).find("asked to fail"),
            std::string::npos);
  EXPECT_NE(message(PHOTOCOAG_EXAMPLE_DRIVER, "", 1e-6).find("control period"), std::string::npos);
  EXPECT_EQ(message(PHOTOCOAG_EXAMPLE_DRIVER, "", kPeriod), "accepted");
}

}  // namespace
}  // namespace photocoag::testing
