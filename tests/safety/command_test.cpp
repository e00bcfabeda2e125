// What the device says it took for its command: late, foreign, or not what it emits; and the power
// that is on its way while the next one is chosen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimation/test_models.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

/// A device that emits what it has in force and says so; the tissue does not matter here.
class Commands {
 public:
  explicit Commands(SafetyLimits limits = patient()) {
    limits.check_quiet = 0;
    limits.noise = 1000.0;  // K: no sample is of interest
    supervisor_ = treating_supervisor(model_1khz(), limits);
  }
  /// An ordinary machine: overruns do not stop.
  static SafetyLimits patient() {
    SafetyLimits limits;
    limits.overruns_in_a_row_max = 100;
    limits.overruns_per_hundred = 100;
    return limits;
  }

  /// One cycle: `command` was in force and `power` emitted, then `next` is asked for.
  Authorization cycle(double command, double power, double next) {
    ++cycle_;
    DeviceSample sample;
    sample.status = DeviceStatus::kGood;
    sample.volume_temperature = 0.0;
    sample.raw = static_cast<std::int64_t>(cycle_);
    sample.sequence = cycle_;
    sample.time_ns = sample.now_ns = static_cast<std::int64_t>(cycle_) * 1'000'000;
    supervisor_.check(sample, {.power = power, .command = command}, DeviceStatus::kGood);
    return supervisor_.authorize(
        {.command = next, .updated = false, .peak = 1.0, .absorption = 1.0});
  }
  /// In force as commanded: cycles to begin with, ending with `next` on its way.
  void healthy(double power, double next) {
    cycle(0.0, 0.0, power);
    for (int k = 0; k < 5; ++k) cycle(power, power, power);
    cycle(power, power, next);
  }
  const SafetyStatus& status() const { return supervisor_.status(); }
  Supervisor& supervisor() { return supervisor_; }
  bool treating() const { return status().state == SafetyState::kTreating; }

 private:
  Supervisor supervisor_ = treating_supervisor(model_1khz());
  std::uint64_t cycle_ = 0;
};

TEST(DeviceCommand, OneThatCameLateIsCountedAndForgiven) {
  Commands c;
  c.healthy(0.004, 0.008);
  c.cycle(0.004, 0.004, 0.011);
  EXPECT_EQ(c.status().late_commands, 1);
  EXPECT_EQ(c.status().last_detection, SafetyReason::kCommandLate);
  c.cycle(0.011, 0.011, 0.011);
  c.cycle(0.011, 0.011, 0.003);
  c.cycle(0.007, 0.007, 0.003);  // some pulses of one, some of the other
  EXPECT_EQ(c.status().late_commands, 2);
  c.cycle(0.003, 0.003, 0.003);
  EXPECT_EQ(c.status().detections, 2);
  EXPECT_TRUE(c.treating()) << to_string(c.status().reason);
}

TEST(DeviceCommand, WithoutWordOfItADifferenceIsTheDevicesFault) {
  const double silent = std::nan("");
  Commands c;
  c.healthy(0.005, 0.010);
  c.cycle(silent, 0.005, 0.015);
  EXPECT_TRUE(c.treating());
  EXPECT_EQ(c.cycle(silent, 0.010, 0.015).power, 0.0);
  EXPECT_EQ(c.status().reason, SafetyReason::kPowerReadback);
}

TEST(DeviceCommand, LateForEverStops) {
  Commands c;
  c.healthy(0.004, 0.008);
  double before = 0.004;
  double now = 0.008;
  int cycles = 0;
  while (c.treating() && cycles < 20) {
    const double next = now == 0.008 ? 0.004 : 0.008;
    c.cycle(before, before, next);
    before = now;
    now = next;
    ++cycles;
  }
  EXPECT_EQ(cycles, 4);
  EXPECT_EQ(c.status().reason, SafetyReason::kCommandLate);
}

TEST(DeviceCommand, IsAnOverrunToOneWhoEnforces) {
  Commands c{SafetyLimits{}};
  c.healthy(0.004, 0.008);
  c.cycle(0.004, 0.004, 0.012);
  EXPECT_TRUE(c.treating());
  c.cycle(0.008, 0.008, 0.012);
  EXPECT_EQ(c.status().reason, SafetyReason::kOverrun);
  EXPECT_EQ(c.status().state, SafetyState::kSafeStop);
}

TEST(DeviceCommand, OneThatNobodyGaveStops) {
  Commands c;
  c.healthy(0.005, 0.010);
  c.cycle(0.030, 0.030, 0.010);
  EXPECT_TRUE(c.treating());
  const Authorization answer = c.cycle(0.030, 0.030, 0.010);
  EXPECT_EQ(c.status().reason, SafetyReason::kPowerReadback);
  EXPECT_TRUE(answer.open_interlock);
  EXPECT_EQ(c.status().late_commands, 0);
}

TEST(DeviceCommand, LightWhereZeroWasCommanded) {
  Commands c;
  c.healthy(0.005, 0.0);
  c.cycle(0.005, 0.005, 0.0);  // the 0 W came late
  EXPECT_TRUE(c.treating());
  const Authorization answer = c.cycle(0.005, 0.005, 0.0);
  EXPECT_EQ(c.status().reason, SafetyReason::kPowerStuckOn);
  EXPECT_TRUE(answer.open_interlock);

  Commands stuck;
  stuck.healthy(0.005, 0.0);
  stuck.cycle(0.0, 0.005, 0.0);  // it knows that it should be dark
  EXPECT_EQ(stuck.status().reason, SafetyReason::kPowerStuckOn);
}

TEST(DeviceCommand, ADeviceIsHeldToItsWord) {
  for (const double factor : {0.5, 1.5}) {
    Commands c;
    c.healthy(0.010, 0.010);
    c.cycle(0.010, 0.010 * factor, 0.010);
    EXPECT_TRUE(c.treating());
    c.cycle(0.010, 0.010 * factor, 0.010);
    EXPECT_EQ(c.status().reason, SafetyReason::kPowerReadback) << factor;
  }
}

TEST(DeviceCommand, AWatchdogThatHadWaitedTooLongIsNoFault) {
  Commands c;
  c.healthy(0.010, 0.010);
  c.cycle(0.0, 0.0, 0.010);
  EXPECT_EQ(c.status().late_commands, 1);
  c.cycle(0.010, 0.010, 0.010);
  EXPECT_TRUE(c.treating());
}

TEST(DeviceCommand, WithADelayThePowerBeforeIsInForce) {
  SafetyLimits limits = Commands::patient();
  limits.command_delay = 1;
  Commands c(limits);
  c.supervisor().authorize({.command = 0.004, .peak = 1.0, .absorption = 1.0});
  c.cycle(0.0, 0.0, 0.008);
  c.cycle(0.004, 0.004, 0.012);
  c.cycle(0.008, 0.008, 0.008);
  EXPECT_EQ(c.status().detections, 0);
  c.cycle(0.008, 0.008, 0.004);  // 0.012 came late
  EXPECT_EQ(c.status().late_commands, 1);
  c.cycle(0.008, 0.008, 0.004);
  // The planned end: 0 W is on its way behind 0.004 W.
  c.supervisor().finish();
  c.cycle(0.004, 0.004, 0.0);
  EXPECT_EQ(c.status().late_commands, 1);
  EXPECT_EQ(c.status().state, SafetyState::kDone);
}

TEST(DeviceCommand, ALateEndIsNoFault) {
  Commands c;
  c.healthy(0.010, 0.010);
  c.supervisor().finish();
  c.cycle(0.010, 0.010, 0.0);
  EXPECT_EQ(c.status().state, SafetyState::kDone);
}

// Full power for ever, one period later than asked: the gate counts what is on its way.
TEST(DeviceCommand, WhatIsOnItsWayIsInTheGatesPrediction) {
  for (const double alpha : {0.3, 0.7363, 1.1, 1.7}) {
    SafetyLimits limits;
    limits.command_delay = 1;
    limits.check_quiet = 0;
    Supervisor supervisor = treating_supervisor(model_1khz(), limits);
    ReducedPlant eye(model_1khz(), alpha);
    const ControllerReport full{.command = 0.1, .peak = 0.0, .absorption = 1.0};
    double coming = supervisor.authorize(full).power;
    double emitted = 0.0;
    double peak = 0.0;
    for (std::uint64_t k = 1; k <= 300; ++k) {
      eye.step(emitted);
      peak = std::max(peak, eye.outputs().peak);
      DeviceSample sample;
      sample.status = DeviceStatus::kGood;
      sample.volume_temperature = eye.outputs().volume;
      sample.raw = static_cast<std::int64_t>(k);
      sample.sequence = k;
      sample.time_ns = sample.now_ns = static_cast<std::int64_t>(k) * 1'000'000;
      supervisor.check(sample, {.power = emitted}, DeviceStatus::kGood);
      emitted = coming;
      coming = supervisor.authorize(full).power;
    }
    EXPECT_LT(peak, 32.01) << alpha;
    EXPECT_GT(peak, 28.0) << alpha << ": it may not simply refuse";
    EXPECT_EQ(supervisor.status().state, SafetyState::kTreating) << alpha;
  }
}

// The same with the observer alone: what the gate would do if it forgot what is on its way.
TEST(DeviceCommand, ForgettingWhatIsOnItsWayWouldOverheat) {
  const auto highest = [](bool awaits) {
    MultiModelObserver observer(observer_for(model_1khz()), 0.288, 0.01);
    ReducedPlant eye(model_1khz(), 1.7);
    double coming = 0.1;
    double emitted = 0.0;
    double peak = 0.0;
    for (int k = 0; k < 300; ++k) {
      eye.step(emitted);
      peak = std::max(peak, eye.outputs().peak);
      observer.emit(emitted);
      if (awaits) observer.queue(coming);
      observer.update(eye.outputs().volume);
      emitted = coming;
      coming = std::min(0.1, observer.power_for_peak(32.0));
    }
    return peak;
  };
  EXPECT_LT(highest(true), 32.01);
  EXPECT_NEAR(highest(false), 37.8, 0.5) << "docs/safety.md";
}

}  // namespace
}  // namespace photocoag::testing
