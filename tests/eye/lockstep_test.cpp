// The eye in lockstep with its controller: nothing depends on how long either takes.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <optional>
#include <thread>
#include <vector>

#include "eye/running_eye.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/run/device_self_test.hpp"
#include "photocoag/run/eye_pacing.hpp"
#include "support/heap_guard.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

class Lockstep : public ::testing::TestWithParam<EyeTransport> {};
INSTANTIATE_TEST_SUITE_P(BothTransports, Lockstep,
                         ::testing::Values(EyeTransport::kSharedMemory, EyeTransport::kSocket),
                         [](const auto& one) {
                           return one.param == EyeTransport::kSocket ? "Socket" : "SharedMemory";
                         });

void dawdle() { std::this_thread::sleep_for(std::chrono::milliseconds(12)); }  // > two periods

TEST_P(Lockstep, ASlowControllerMissesNothing) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  device.follow_in_lockstep();
  device.prepare(GrueneisenCurve(water_like_curve()), {}, 100);
  device.begin(12);
  device.write_power(0.02, 1);
  std::int64_t before = 0;
  for (std::uint64_t cycle = 0; cycle < 12; ++cycle) {
    if (cycle % 4 == 2) dawdle();
    const DeviceSample sample = device.wait_sample(cycle);
    ASSERT_EQ(sample.status, DeviceStatus::kGood);
    EXPECT_EQ(sample.periods_behind, 0u);
    EXPECT_EQ(sample.now_ns, sample.time_ns) << "virtual time";
    if (cycle > 0) {
      EXPECT_EQ(sample.time_ns - before, 5'000'000);
    }
    before = sample.time_ns;
    EXPECT_EQ(device.readback().power, 0.02) << "the command holds from its period's first pulse";
    EXPECT_EQ(device.readback().command, 0.02);
    EXPECT_TRUE(std::isfinite(sample.volume_temperature));
    if (cycle % 4 == 1) dawdle();
    EXPECT_EQ(device.write_power(0.02, cycle + 2), DeviceStatus::kGood);
  }
  EXPECT_EQ(device.late_pulses(), 0u);
  ASSERT_EQ(device.finish_truth().size(), 12u);
  EXPECT_GT(device.finish_truth().back().outputs.peak, 1.0);
}

TEST_P(Lockstep, TheSelfTestSeesTheWatchdogTrip) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  device.follow_in_lockstep();
  constexpr int kBaselinePulses = 100;
  device.prepare(GrueneisenCurve(water_like_curve()), {}, kBaselinePulses);
  device.begin(0);
  const SelfTestReport report = self_test(device, ControlSettings{}, true);
  EXPECT_EQ(report.samples, 64);
  EXPECT_TRUE(report.watchdog_tripped);
  SafetyLimits limits;
  // Which pulses, and with them which noise, the baseline has depends on when it begins.
  limits.zero_error =
      limits.noise * std::sqrt(static_cast<double>(device.pulses_per_period()) / kBaselinePulses);
  const std::vector<std::string> failed = failed_items(report, limits);
  EXPECT_TRUE(failed.empty()) << failed.front();
}

TEST_P(Lockstep, WithoutACommandTwoPeriodsOfLightAtMost) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  device.follow_in_lockstep();
  device.begin(8);
  device.write_power(0.02, 1);
  for (std::uint64_t cycle = 0; cycle < 8; ++cycle) {
    device.wait_sample(cycle);
    EXPECT_EQ(device.readback().power, cycle < 2 ? 0.02 : 0.0) << cycle;
  }
}

TEST_P(Lockstep, ADeadControllerIsDark) {
  RunningEye eye(false, 0.05);
  EyeDevice device(eye.link(GetParam()));
  device.follow_in_lockstep();
  device.begin(8);
  device.write_power(0.02, 1);
  device.wait_sample(0);
  device.write_power(0.02, 2);
  const Mapped<const EyeSharedMemory> seen = observe_eye(eye.socket());
  const std::uint64_t stopped = seen->pulses.load();
  // It hangs, its connection stands: after 50 ms the eye goes on by the clock.
  const std::int64_t give_up = monotonic_ns() + 20'000'000'000;
  while (seen->pulses.load() < stopped + 40 && monotonic_ns() < give_up) dawdle();
  ASSERT_GE(seen->pulses.load(), stopped + 40);
  int lit = 0;
  for (std::uint64_t p = stopped; p < stopped + 40; ++p) {
    lit += seen->records[p % kEyeRing].power_readback > 0.0 ? 1 : 0;
  }
  EXPECT_LE(lit, 20) << "two periods of ten pulses";
  EXPECT_EQ(seen->records[(stopped + 39) % kEyeRing].power_readback, 0.0);
  EXPECT_EQ(eye.status("lockstep"), 0);
}

TEST_P(Lockstep, TheNextControllerFindsAnEyeOnTheClock) {
  RunningEye eye;
  {
    EyeDevice device(eye.link(GetParam()));
    device.follow_in_lockstep();
    device.begin(200);
    for (std::uint64_t cycle = 0; cycle < 200; ++cycle) device.wait_sample(cycle);  // a second
  }
  eye.wait_until_free();
  EyeDevice device(eye.link(GetParam()));
  device.begin(4);
  const DeviceSample sample = device.wait_sample(0);
  EXPECT_EQ(sample.status, DeviceStatus::kGood);
  EXPECT_LT(std::abs(static_cast<double>(sample.time_ns - monotonic_ns())), 10e9);
  EXPECT_EQ(eye.status("lockstep"), 0);
}

TEST_P(Lockstep, TheLoopsCallsAllocateNothing) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  device.follow_in_lockstep();
  device.prepare(GrueneisenCurve(water_like_curve()), {}, 50);
  device.begin(10);
  const HeapGuard guard;
  for (std::uint64_t cycle = 0; cycle < 5; ++cycle) {
    device.write_power(0.01, cycle + 1);
    device.wait_sample(cycle);
    device.readback();
  }
  device.safe_off();
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
}

TEST(EyePacing, AutoTakesTheClockWhereBothKeepItAndLockstepElse) {
  Config config;
  EyeWelcome eye{.abilities = kEyeHasPriority};
  EXPECT_FALSE(choose_pace(config, eye, true, 2).lockstep);
  EXPECT_NE(choose_pace(config, eye, false, 2).describe().find("SCHED_FIFO"), std::string::npos);
  EXPECT_NE(choose_pace(config, eye, true, 1).describe().find("one core"), std::string::npos);
  EXPECT_FALSE(pace_after_baseline(config, eye, 0.01).lockstep);
  EXPECT_NE(pace_after_baseline(config, eye, 0.5).describe().find("50 %"), std::string::npos);
  eye.abilities = 0;
  EXPECT_TRUE(choose_pace(config, eye, true, 2).lockstep) << "the eye has no priority";
  // Where real time is demanded, or a fault takes wall time, the clock.
  config.safety.real_time = RealTimeMode::kEnforce;
  EXPECT_FALSE(choose_pace(config, eye, false, 1).lockstep);
  config.safety.real_time = RealTimeMode::kObserve;
  eye.abilities = kEyeNeedsWall;
  EXPECT_FALSE(choose_pace(config, eye, false, 1).lockstep);
  EXPECT_FALSE(pace_after_baseline(config, eye, 0.5).lockstep);
  config.photoacoustics.eye_pacing = EyePacing::kLockstep;
  EXPECT_NE(message_of([&] { choose_pace(config, eye, true, 2); }).find("wall time"),
            std::string::npos);
  eye.abilities = kEyeHasPriority;
  EXPECT_TRUE(choose_pace(config, eye, true, 2).lockstep);
  config.photoacoustics.eye_pacing = EyePacing::kWall;
  eye.abilities = 0;
  EXPECT_FALSE(choose_pace(config, eye, false, 1).lockstep);
}

TEST(EyePacing, FaultsInWallTimeAreNotAddedInLockstep) {
  RunningEye eye;
  EyeDevice device(eye.link(EyeTransport::kSharedMemory));
  device.follow_in_lockstep();
  device.begin(2);
  EXPECT_NE(command_eye(eye.socket(), "fault T1@5*2").find("refused"), std::string::npos);
  EXPECT_EQ(command_eye(eye.socket(), "fault M2@120"), "ok");
}

}  // namespace
}  // namespace photocoag::testing
