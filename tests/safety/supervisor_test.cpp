// States, latch and gate of the supervisor, cycle by cycle and without a loop.
#include "photocoag/safety/supervisor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "safety/supervisors.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// One healthy cycle after another: an eye of the reduced model, noise of a fixed seed.
struct Bench {
  Supervisor supervisor = treating_supervisor(model_1khz());
  ReducedPlant eye{model_1khz(), 1.1};
  Draw draw{1};
  std::uint64_t cycle = 0;
  double written = 0.0;

  DeviceSample sample(double power) {
    eye.step(power);
    ++cycle;
    DeviceSample s;
    s.status = DeviceStatus::kGood;
    s.volume_temperature = eye.outputs().volume + 0.288 * draw.normal();
    s.raw = std::lround(s.volume_temperature / 0.005);
    s.sequence = cycle;
    s.time_ns = s.now_ns = static_cast<std::int64_t>(cycle) * 1'000'000;
    return s;
  }
  ControllerReport report(double command) {
    return {.command = command,
            .updated = true,
            .peak = eye.outputs().peak,
            .absorption = 1.1,
            .innovation = 0.288 * draw.normal(),
            .innovation_sigma = 0.288};
  }
  Authorization healthy(double command) {
    supervisor.check(sample(written), {.power = written}, DeviceStatus::kGood);
    const Authorization answer = supervisor.authorize(report(command));
    written = answer.power;
    return answer;
  }
};

TEST(SupervisorStates, OnlyTreatingEmits) {
  const ObserverModel observer = observer_for(model_1khz());
  Supervisor s(SafetyLimits{}, observer);
  const ControllerReport wants{.command = 0.02, .absorption = 1.0};
  EXPECT_EQ(s.authorize(wants).power, 0.0) << "OFF";
  EXPECT_FALSE(s.ready());
  EXPECT_FALSE(s.finish_self_test(good_self_test())) << "no self-test before power_on";
  s.power_on();
  EXPECT_EQ(s.authorize(wants).power, 0.0) << "SELFTEST";
  EXPECT_TRUE(s.finish_self_test(good_self_test()));
  EXPECT_EQ(s.authorize(wants).power, 0.0) << "STANDBY";
  EXPECT_FALSE(s.begin(true)) << "not from STANDBY";
  EXPECT_TRUE(s.ready());
  EXPECT_EQ(s.authorize(wants).power, 0.0) << "READY";
  EXPECT_FALSE(s.begin(false)) << "not without the foot switch";
  EXPECT_TRUE(s.begin(true));
  EXPECT_EQ(s.authorize(wants).power, 0.02) << "TREATING";
  s.finish();
  EXPECT_EQ(s.authorize(wants).power, 0.0) << "DONE";
}

TEST(SupervisorStates, EveryPartOfTheSelfTestCanRefuse) {
  const ObserverModel observer = observer_for(model_1khz());
  const auto passes = [&](auto spoil) {
    Supervisor s(SafetyLimits{}, observer);
    s.power_on();
    SelfTestReport report = good_self_test();
    spoil(report);
    const bool passed = s.finish_self_test(report);
    EXPECT_EQ(s.status().state, passed ? SafetyState::kStandby : SafetyState::kSafeStop);
    EXPECT_EQ(s.ready(), passed);
    return passed;
  };
  EXPECT_TRUE(passes([](SelfTestReport&) {}));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.mean = 0.2; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.mean = kNan; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.sigma = 0.6; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.sigma = 0.14; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.sigma = kNan; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.samples = 31; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.power_at_zero = 3e-3; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.power_at_zero = kNan; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.interlock_closed = false; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.shutter_open = false; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.foot_switch = false; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.watchdog_tripped = false; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.model_matches = false; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.solver_exact = false; }));
  EXPECT_FALSE(passes([](SelfTestReport& r) { r.log_has_room = false; }));
}

TEST(SupervisorStates, SafeStopLatchesUntilResetAndSelfTest) {
  Bench b;
  for (int k = 0; k < 20; ++k) EXPECT_EQ(b.healthy(0.02).power, 0.02);
  b.supervisor.check(b.sample(b.written), {.power = b.written, .interlock_closed = false},
                     DeviceStatus::kGood);
  b.written = b.supervisor.authorize(b.report(0.02)).power;
  EXPECT_EQ(b.written, 0.0);
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(b.healthy(0.02).power, 0.0) << "healthy again: latched";
  Supervisor& s = b.supervisor;
  EXPECT_EQ(s.status().state, SafetyState::kSafeStop);
  EXPECT_EQ(s.status().reason, SafetyReason::kInterlock);
  s.finish();
  EXPECT_FALSE(s.ready());
  EXPECT_FALSE(s.begin(true));
  EXPECT_EQ(s.status().state, SafetyState::kSafeStop);
  s.reset();
  EXPECT_FALSE(s.ready()) << "a self-test lies between";
  EXPECT_TRUE(s.finish_self_test(good_self_test()));
  EXPECT_TRUE(s.ready());
  EXPECT_TRUE(s.begin(true));
  EXPECT_EQ(s.authorize({.command = 0.02, .absorption = 1.0}).power, 0.02);
}

TEST(SupervisorStates, ReleasedFootSwitchIsStandby) {
  Bench b;
  b.healthy(0.02);
  b.supervisor.check(b.sample(b.written), {.power = b.written, .foot_switch = false},
                     DeviceStatus::kGood);
  EXPECT_EQ(b.supervisor.authorize(b.report(0.02)).power, 0.0);
  EXPECT_EQ(b.supervisor.status().state, SafetyState::kStandby);
  EXPECT_TRUE(b.supervisor.ready());
}

TEST(SupervisorGate, AMillionWildCyclesWriteNothingBad) {
  // Any bit pattern in every number that comes from outside; restarted whenever it has stopped.
  const ObserverModel observer = observer_for(model_1khz());
  SafetyLimits limits;
  limits.power_rise_max = 0.03;
  Draw draw(7);
  const auto wild = [&] {
    const double kind = draw.between(0.0, 1.0);
    if (kind < 0.6) return draw.between(-0.05, 0.15);
    if (kind < 0.7) return kNan;
    if (kind < 0.8) return draw.chance(0.5) ? 1e308 : -std::numeric_limits<double>::infinity();
    if (kind < 0.9) return std::numeric_limits<double>::denorm_min();
    return draw.between(0.0999999, 0.1000001);
  };
  Supervisor s(limits, observer);
  s.power_on();
  double last = 0.0;
  long emitted = 0;
  for (int k = 0; k < 1'000'000; ++k) {
    if (s.status().state != SafetyState::kTreating) {
      s.reset();
      s.finish_self_test(good_self_test());
      s.ready();
      ASSERT_TRUE(s.begin(true));
      last = 0.0;
    }
    if (draw.chance(0.5)) {
      DeviceSample sample;
      sample.status = DeviceStatus::kGood;
      sample.volume_temperature = wild() * 100.0;
      sample.sequence = static_cast<std::uint64_t>(k) + 1;
      s.check(sample, {.power = draw.chance(0.8) ? last : wild()}, DeviceStatus::kGood);
    }
    const ControllerReport report{
        .command = wild(),
        .solve = draw.chance(0.9) ? SolveOutcome::kSolved : SolveOutcome::kFailed,
        .updated = draw.chance(0.1),
        .peak = draw.chance(0.9) ? 10.0 : wild(),
        .absorption = draw.chance(0.9) ? 1.0 : wild(),
        .innovation = wild(),
        .innovation_sigma = draw.chance(0.9) ? 1.0 : wild()};
    const double power = s.authorize(report).power;
    ASSERT_TRUE(power >= 0.0 && power <= 0.1) << k;
    ASSERT_LE(power, last + 0.03 + 1e-15) << k;
    last = power;
    emitted += power > 0.0 ? 1 : 0;
  }
  EXPECT_GT(emitted, 100'000) << "a gate that never opens would pass as well";
}

TEST(SupervisorGate, NoPlausibleAbsorptionIsOverheated) {
  // Full power for ever: the true peak stays below the limit, whatever the eye absorbs.
  for (const double alpha : {0.3, 0.7363, 1.1, 1.7}) {
    Bench b;
    b.eye = ReducedPlant(model_1khz(), alpha);
    double peak = 0.0;
    double energy = 0.0;
    for (int k = 0; k < 300; ++k) {
      b.supervisor.check(b.sample(b.written), {.power = b.written}, DeviceStatus::kGood);
      ControllerReport report = b.report(0.1);
      report.peak = 0.0;  // an estimator that believes the tissue is cold
      b.written = b.supervisor.authorize(report).power;
      energy += b.written;
      peak = std::max(peak, b.eye.outputs().peak);
    }
    EXPECT_LT(peak, 32.0) << alpha;
    EXPECT_GT(peak, 28.0) << alpha << ": it may not simply refuse";
    EXPECT_EQ(b.supervisor.status().state, SafetyState::kTreating) << alpha;
  }
}

/// A warm eye, a last good plan, then a solver that gives no answer.
struct FallbackBench : Bench {
  FallbackBench() {
    for (int k = 0; k < 60; ++k) healthy(0.02);
  }
  void good(std::array<double, 2> plan) {
    supervisor.check(sample(written), {.power = written}, DeviceStatus::kGood);
    ControllerReport wants = report(0.02);
    wants.plan = plan;
    written = supervisor.authorize(wants).power;
  }
  Authorization failed(bool restarted = false) {
    supervisor.check(sample(written), {.power = written}, DeviceStatus::kGood);
    ControllerReport wants = report(0.09);
    wants.solve = restarted ? SolveOutcome::kSolved : SolveOutcome::kFailed;
    wants.restarted = restarted;
    wants.plan = {0.09, 0.09};  // of a solve that failed: worth nothing
    const Authorization answer = supervisor.authorize(wants);
    written = answer.power;
    return answer;
  }
  double steady() { return std::min(written, supervisor.observer().steady_power(30.0)); }
};

TEST(SupervisorGate, TheFallbackBeginsWithTheLastGoodPlan) {
  FallbackBench b;
  b.good({0.017, 0.015});
  EXPECT_EQ(b.failed().power, 0.017);
  const Authorization second = b.failed();
  EXPECT_EQ(second.power, 0.015);
  EXPECT_EQ(second.reason, SafetyReason::kSolverFailed);
  EXPECT_EQ(b.failed().power, 0.0) << "at most 2 cycles";
  EXPECT_EQ(b.supervisor.status().state, SafetyState::kSafeStop);
}

TEST(SupervisorGate, APlanThatCannotBeTrustedIsNone) {
  for (const double plan : {kNan, -0.01, 0.1}) {  // 0.1 W would overheat the warm eye
    FallbackBench b;
    b.good({plan, plan});
    EXPECT_EQ(b.failed().power, b.steady()) << plan;
  }
  FallbackBench rising;
  rising.good({0.021, 0.022});
  EXPECT_EQ(rising.failed().power, 0.02) << "never above the previous power";
  FallbackBench cold;
  cold.good({0.001, 0.001});
  EXPECT_EQ(cold.failed(true).power, cold.steady()) << "made with an estimate that broke down";
}

TEST(SupervisorLimits, EveryFlippedBitIsSeen) {
  Bench b;
  b.healthy(0.02);
  const std::span<std::byte> memory = b.supervisor.limits_memory().memory();
  for (std::size_t bit = 0; bit < 8 * memory.size(); ++bit) {
    const auto mask = static_cast<std::byte>(1U << bit % 8);
    memory[bit / 8] ^= mask;
    EXPECT_FALSE(b.supervisor.limits_memory().intact()) << bit;
    memory[bit / 8] ^= mask;
    ASSERT_TRUE(b.supervisor.limits_memory().intact());
  }
  memory[9] ^= std::byte{4};
  EXPECT_EQ(b.supervisor.authorize(b.report(0.02)).power, 0.0) << "in the same cycle";
}

TEST(SupervisorLimits, EnergyTimeAndDoseEndTheTreatment) {
  const auto cycles_until_done = [](auto change, SafetyReason reason) {
    SafetyLimits limits;
    change(limits);
    Bench b;
    b.supervisor = treating_supervisor(model_1khz(), limits);
    int cycles = 0;
    while (b.supervisor.status().state == SafetyState::kTreating && cycles < 1000) {
      b.healthy(0.02);
      ++cycles;
    }
    EXPECT_EQ(b.supervisor.status().state, SafetyState::kDone);
    EXPECT_EQ(b.supervisor.status().reason, reason);
    EXPECT_EQ(b.healthy(0.02).power, 0.0);
    return cycles;
  };
  // 20 mW for 1 ms is 20 uJ: 50 of them fit into 1 mJ. The first cycle has emitted nothing.
  EXPECT_EQ(
      cycles_until_done([](SafetyLimits& l) { l.energy_max = 1e-3 + 1e-9; }, SafetyReason::kEnergy),
      51);
  EXPECT_EQ(
      cycles_until_done([](SafetyLimits& l) { l.exposure_max = 0.05; }, SafetyReason::kExposure),
      51);
  EXPECT_LT(cycles_until_done(
                [](SafetyLimits& l) {
                  l.ambient_celsius = 37.0;
                  l.dose_max = 1e-4;
                  l.dose_log_frequency = std::log(3e44);
                  l.dose_activation_energy = 273e3;
                },
                SafetyReason::kThermalDose),
            1000);
}

TEST(SupervisorHeap, NothingIsAllocatedInAnyBranch) {
  Bench b;
  double sum = 0.0;
  const HeapGuard guard;
  for (int k = 0; k < 200; ++k) {
    DeviceSample sample = b.sample(b.written);
    if (k % 7 == 3) sample.volume_temperature = kNan;
    if (k % 31 == 5) sample.sequence = 1;
    b.supervisor.check(sample, {.power = b.written}, DeviceStatus::kGood);
    ControllerReport report = b.report(k % 13 == 2 ? kNan : 0.02);
    report.restarted = k == 50;
    b.written = b.supervisor.authorize(report).power;
    sum += b.written;
    if (k == 150) b.supervisor.reset();
  }
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace photocoag::testing
