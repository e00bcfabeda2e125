// An acquisition program as a device: against a scripted one in a thread of this process. Where the
// machine held either of the two up, the script is played again: nothing here depends on its speed.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "photocoag/core/stop_signal.hpp"
#include "rt/scripted_program.hpp"
#include "support/heap_guard.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint64_t kFirst = 9;  // period of cycle 0: eight are looked at before

struct Cycle {
  DeviceSample sample;
  Readback readback;
};

struct Played {
  std::vector<Cycle> cycles;
  UdpDrops drops;
  std::vector<UdpAnswer> answers;
  /// Of a period by the program's number.
  const Cycle& at(std::uint64_t period) const { return cycles.at(period - kFirst); }
};

/// A dozen periods, 10 mW in each. Nothing if the machine was too busy every time.
std::optional<Played> play(const Program::Script& script,
                           const std::function<void(std::uint64_t)>& before_wait = {}) {
  for (int attempt = 0; attempt < 10; ++attempt) {
    Played played;
    played.cycles.resize(12);
    Program program(free_port(), script);
    UdpDevice device(std::to_string(program.port()), 1, kPeriod, false);
    bool held_up = false;
    HeapUse use;
    {
      const HeapGuard guard;
      for (std::uint64_t k = 0; k < played.cycles.size(); ++k) {
        device.write_power(0.01, k + 1);
        if (before_wait) before_wait(k + kFirst);
        const std::int64_t begun = monotonic_ns();
        const DeviceSample sample = device.wait_sample(k);
        const std::int64_t took = monotonic_ns() - begun;
        played.cycles[k] = {sample, device.readback()};
        held_up = held_up || took > kPeriodNs * 17 / 10 ||
                  (!before_wait && sample.now_ns - sample.time_ns > kPeriodNs * 7 / 10);
      }
      use = guard.use();
    }
    EXPECT_EQ(use, HeapUse{});
    played.drops = device.drops();
    program.end();
    played.answers = program.answers();
    const DeviceSample& first = played.cycles[0].sample;
    held_up = held_up || first.raw != static_cast<std::int64_t>(kFirst) || first.sequence != 1;
    if (!held_up && !program.was_late()) return played;
  }
  return std::nullopt;
}

void good(Program& program, const UdpSample& sample) { program.send(sample); }

/// As sent, except in period 12.
Program::Script in_period_12(Program::Script script) {
  return [script](Program& program, const UdpSample& sample) {
    sample.sequence == 12 ? script(program, sample) : program.send(sample);
  };
}

void expect_good(const Played& played, std::uint64_t period) {
  const Cycle& cycle = played.at(period);
  EXPECT_EQ(cycle.sample.status, DeviceStatus::kGood) << period;
  EXPECT_EQ(cycle.sample.volume_temperature, static_cast<double>(period));
  EXPECT_EQ(cycle.sample.raw, static_cast<std::int64_t>(period));
  EXPECT_EQ(cycle.sample.sequence, period - kFirst + 1);
  EXPECT_EQ(cycle.sample.periods_behind, 0U);
  EXPECT_EQ(cycle.readback.power, 0.01);
}

void expect_missing(const Played& played, std::uint64_t period) {
  const Cycle& cycle = played.at(period);
  EXPECT_EQ(cycle.sample.status, DeviceStatus::kTimeout) << period;
  EXPECT_TRUE(std::isnan(cycle.sample.volume_temperature));
  EXPECT_EQ(cycle.sample.sequence, period - kFirst + 1);
  EXPECT_EQ(cycle.sample.periods_behind, 0U);
  EXPECT_TRUE(std::isnan(cycle.readback.power));
  EXPECT_TRUE(cycle.readback.interlock_closed) << "as it was said last";
}

void expect_only_12_missing(const Played& played) {
  for (std::uint64_t period = kFirst; period < kFirst + played.cycles.size(); ++period) {
    period == 12 ? expect_missing(played, period) : expect_good(played, period);
  }
}

void expect_all_good(const Played& played) {
  for (std::uint64_t period = kFirst; period < kFirst + played.cycles.size(); ++period) {
    expect_good(played, period);
  }
}

#define PLAY(played, ...)                            \
  const auto played##_or_none = play(__VA_ARGS__);   \
  if (!played##_or_none) GTEST_SKIP() << "too busy"; \
  const Played& played = *played##_or_none

TEST(UdpDevice, EachPeriodHasItsSampleAndItsPowerWithoutAllocation) {
  PLAY(played, in_period_12([](Program& program, UdpSample sample) {
         sample.flags = kUdpSaturated | kUdpStopAsked | kUdpShutterOpen;
         sample.command = kNaN;
         program.send(sample);
       }));
  expect_all_good(played);
  EXPECT_EQ(played.at(11).readback.command, 0.011);
  EXPECT_FALSE(played.at(11).sample.saturated || played.at(11).sample.stop_asked);
  EXPECT_TRUE(played.at(11).readback.foot_switch && played.at(11).readback.shutter_open);
  EXPECT_TRUE(std::isnan(played.at(12).readback.command)) << "not told";
  EXPECT_TRUE(played.at(12).sample.saturated && played.at(12).sample.stop_asked);
  EXPECT_TRUE(played.at(12).readback.shutter_open);
  EXPECT_FALSE(played.at(12).readback.interlock_closed || played.at(12).readback.foot_switch);
  EXPECT_EQ(played.drops.foreign + played.drops.old + played.drops.untimely, 0U);

  std::uint64_t token = 0;
  std::uint64_t period = 0;
  for (const UdpAnswer& answer : played.answers) {
    if (answer.head.kind != UdpKind::kPower) continue;
    EXPECT_EQ(answer.head.session, played.answers.front().head.session);
    EXPECT_GT(answer.token, token) << "a heartbeat";
    EXPECT_GE(answer.period, period);
    token = answer.token;
    period = answer.period;
    if (answer.power == 0.0) continue;
    // After sample 8 the period that runs is 9; with a delay of one it holds from the next.
    EXPECT_EQ(answer.power, 0.01);
    EXPECT_EQ(answer.period, answer.token + 1) << "eight tokens at 0 W before";
  }
  EXPECT_EQ(period, kFirst + 12);
}

TEST(UdpDevice, ALostDatagramIsAMissingSample) {
  PLAY(played, in_period_12([](Program&, const UdpSample&) {}));
  expect_only_12_missing(played);
}

TEST(UdpDevice, ARepeatedDatagramIsCountedOnce) {
  PLAY(played, in_period_12([](Program& program, const UdpSample& sample) {
         for (int i = 0; i < 3; ++i) program.send(sample);
       }));
  expect_all_good(played);
  EXPECT_EQ(played.drops.old, 2U);
}

TEST(UdpDevice, AnOvertakenDatagramIsOld) {
  UdpSample held;
  PLAY(played, [&held](Program& program, const UdpSample& sample) {
    if (sample.sequence != 12) program.send(sample);
    if (sample.sequence == 12) held = sample;
    if (sample.sequence == 13) program.send(held);
  });
  expect_only_12_missing(played);
  EXPECT_EQ(played.drops.old, 1U);
}

TEST(UdpDevice, AnotherSenderIsNotBelieved) {
  PLAY(played, in_period_12([](Program& program, UdpSample sample) {
         UdpSample false_one = sample;
         false_one.volume_temperature = -5.0;
         Sender().send(program.port(), &false_one, sizeof(false_one));
         program.send(sample);
       }));
  expect_all_good(played);
  EXPECT_EQ(played.drops.foreign, 1U);
}

TEST(UdpDevice, WhatIsNoSampleIsDroppedAndCounted) {
  PLAY(played, in_period_12([](Program& program, const UdpSample& sample) {
         UdpSample bad = sample;
         bad.volume_temperature = -5.0;
         for (const std::size_t size : {0U, 16U, 71U, 73U, 144U}) program.send(bad, size);
         const auto with = [&](auto change) {
           UdpSample changed = bad;
           change(changed.head);
           program.send(changed);
         };
         with([](UdpHead& head) { head.magic = 0x504F4347; });  // big-endian
         with([](UdpHead& head) { head.version = 2; });
         with([](UdpHead& head) { head.kind = UdpKind::kHello; });
         with([](UdpHead& head) { head.session += 1; });
         program.send(sample);
       }));
  expect_all_good(played);
  EXPECT_EQ(played.drops.unreadable, 9U);
}

TEST(UdpDevice, ImpossibleValuesAreDroppedAndCounted) {
  PLAY(played, in_period_12([](Program& program, const UdpSample& sample) {
         const auto with = [&](auto change) {
           UdpSample changed = sample;
           changed.raw = -5;
           change(changed);
           program.send(changed);
         };
         with([](UdpSample& s) { s.volume_temperature = kInfinity; });
         with([](UdpSample& s) { s.power = kNaN; });
         with([](UdpSample& s) { s.power = -kInfinity; });
         with([](UdpSample& s) { s.command = kInfinity; });
         with([](UdpSample& s) { s.flags = kUdpFlags + 1; });
         with([](UdpSample& s) { s.sequence = 0; });
         program.send(sample);
       }));
  expect_all_good(played);
  EXPECT_EQ(played.drops.impossible, 6U);
}

TEST(UdpDevice, NoTemperatureIsASampleWithoutOne) {
  PLAY(played, in_period_12([](Program& program, UdpSample sample) {
         sample.volume_temperature = kNaN;
         program.send(sample);
       }));
  EXPECT_EQ(played.at(12).sample.status, DeviceStatus::kGood);
  EXPECT_TRUE(std::isnan(played.at(12).sample.volume_temperature));
  EXPECT_EQ(played.at(12).readback.power, 0.01) << "what was emitted is known";
  expect_good(played, 13);
}

TEST(UdpDevice, WhatIsNotOfItsPeriodIsNotBelieved) {
  PLAY(played, in_period_12([](Program& program, const UdpSample& sample) {
         UdpSample ahead = sample;  // by our clock
         ahead.sequence += 1;
         ahead.time_ns += kPeriodNs;
         program.send(ahead);
         // By the program's clock: another reading of the period before, or of the one to come.
         for (const double off : {-1.0, -0.6, 0.6, 1e11}) {
           UdpSample shifted = sample;
           shifted.time_ns += static_cast<std::int64_t>(off * kPeriod * 1e9);
           program.send(shifted);
         }
         for (const std::uint64_t number :
              {std::uint64_t{13}, std::uint64_t{100}, ~std::uint64_t{0}}) {
           UdpSample numbered = sample;
           numbered.sequence = number;
           program.send(numbered);
         }
       }));
  expect_only_12_missing(played);
  EXPECT_EQ(played.drops.untimely, 8U);
}

TEST(UdpDevice, ALateDatagramIsMissing) {
  PLAY(played, in_period_12([](Program& program, const UdpSample& sample) {
         program.send_late(sample, 0.75);
       }));
  expect_only_12_missing(played);
  EXPECT_EQ(played.drops.old, 1U);
}

TEST(UdpDevice, ALoopThatWakesUpLateGetsTheMissedPeriodsOneByOne) {
  PLAY(played, good, [](std::uint64_t period) {
    if (period == 12) wait_until(monotonic_ns() + static_cast<std::int64_t>(3.4e9 * kPeriod));
  });
  for (const std::uint64_t period : {12U, 13U}) {
    const Cycle& cycle = played.at(period);
    EXPECT_EQ(cycle.sample.periods_behind, 14 - period);
    EXPECT_TRUE(std::isnan(cycle.sample.volume_temperature)) << "history";
    EXPECT_EQ(cycle.sample.raw, static_cast<std::int64_t>(period));
    EXPECT_EQ(cycle.readback.power, 0.01) << "known all the same";
  }
  for (const std::uint64_t period : {11U, 14U, 15U, 16U}) expect_good(played, period);
  EXPECT_EQ(played.drops.untimely, 0U) << "the kernel knows when they came";
}

TEST(UdpDevice, AProgramThatIsSilentIsGoneAfterASecond) {
  Program program(free_port(), good);
  UdpDevice device(std::to_string(program.port()), 0, kPeriod, false);
  program.end();
  DeviceStatus status = DeviceStatus::kTimeout;
  const std::int64_t begun = monotonic_ns();
  std::int64_t shortest = begun;
  for (std::uint64_t k = 0; k < 500 && status != DeviceStatus::kGone; ++k) {
    const std::int64_t before = monotonic_ns();
    status = device.wait_sample(k).status;
    if (status == DeviceStatus::kTimeout) shortest = std::min(shortest, monotonic_ns() - before);
  }
  EXPECT_LT(shortest, kPeriodNs * 8 / 5) << "no wait takes longer than one and a half periods";
  EXPECT_EQ(status, DeviceStatus::kGone);
  EXPECT_GT(monotonic_ns() - begun, 900'000'000);
}

TEST(UdpDevice, TokensNeverComeTwice) {
  Program program(free_port(), good);
  UdpDevice device(std::to_string(program.port()), 0, kPeriod, false);
  EXPECT_EQ(device.name(), "scripted?") << "printable";
  EXPECT_EQ(device.write_power(0.02, 1), DeviceStatus::kGood);
  EXPECT_EQ(device.write_power(0.03, 1), DeviceStatus::kTimeout);
  device.begin();
  EXPECT_EQ(device.write_power(0.04, 1), DeviceStatus::kGood) << "counted anew";
  device.wait_sample(0);
  program.end();
  std::uint64_t token = 0;
  double most = 0.0;
  for (const UdpAnswer& answer : program.answers()) {
    EXPECT_NE(answer.power, 0.03);
    most = std::max(most, answer.power);
    if (answer.head.kind != UdpKind::kPower) continue;
    EXPECT_GT(answer.token, token);
    token = answer.token;
  }
  EXPECT_EQ(most, 0.04);
}

TEST(UdpDevice, SafeOffIsSaidSeveralTimesAndNoTokenFollows) {
  Program program(free_port(), good);
  {
    UdpDevice device(std::to_string(program.port()), 0, kPeriod, false);
    device.write_power(0.02, 1);
    device.safe_off();
    EXPECT_NE(device.write_power(0.02, 2), DeviceStatus::kGood);
    EXPECT_EQ(device.write_power(0.0, 3), DeviceStatus::kGood);
  }
  wait_until(monotonic_ns() + 2 * kPeriodNs);
  program.end();
  int offs = 0;
  for (const UdpAnswer& answer : program.answers()) {
    if (answer.head.kind == UdpKind::kOff) {
      ++offs;
      EXPECT_EQ(answer.power, 0.0);
      EXPECT_EQ(answer.token, 0U);
    } else {
      EXPECT_EQ(offs, 0) << "a token after the end";
    }
  }
  EXPECT_GE(offs, 6);
}

TEST(UdpDevice, WhoDoesNotFitIsRefusedInWords) {
  const auto refused = [](UdpHello hello) {
    Program program(free_port(), good, hello);
    return thrown_by([&] { UdpDevice(std::to_string(program.port()), 0, kPeriod, false); });
  };
  UdpHello newer;
  newer.head.version = 2;
  EXPECT_NE(refused(newer).problem.find("version"), std::string::npos);
  EXPECT_EQ(refused(newer).found, "version 2");
  UdpHello slower;
  slower.period_ns = 2 * kPeriodNs;
  EXPECT_NE(refused(slower).problem.find("control period"), std::string::npos);
  EXPECT_EQ(refused(slower).found, "40 ms");
  EXPECT_EQ(refused(slower).key, "") << "the device's fault";

  const auto alone = [](const std::string& address) {
    return thrown_by([&] { UdpDevice(address, 0, kPeriod, false); });
  };
  for (const char* bad :
       {"", "0", "65536", "50x", "50 ", "localhost:5020", ":5020", "1.2.3:5020"}) {
    EXPECT_EQ(alone(bad).key, "udp") << bad;
  }
  Sender taken;
  EXPECT_NE(alone(std::to_string(taken.bind_to(0))).accepted.find("no other program"),
            std::string::npos);
  ask_to_stop();  // or it would wait ten seconds
  EXPECT_NE(alone(std::to_string(free_port())).problem.find("said hello"), std::string::npos);
  forget_stop();
}

TEST(UdpDevice, LightNeedsLeave) {
  const std::uint16_t port = free_port();
  UdpHello hello;
  hello.period_ns = kPeriodNs;
  Sender sender;
  std::atomic<bool> over = false;
  std::thread saying([&] {
    for (; !over; wait_until(monotonic_ns() + kPeriodNs)) sender.send(port, &hello, sizeof(hello));
  });
  const ErrorParts refused = thrown_by([&] { UdpDevice(std::to_string(port), 0, kPeriod, false); });
  over = true;
  saying.join();
  EXPECT_EQ(refused.key, "safety.real_time");
}

}  // namespace
}  // namespace photocoag::testing
