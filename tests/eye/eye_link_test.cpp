// The eye's server and the controller's device, over both transports, on threads of this process.
// Nothing here depends on how fast the machine is: waits are generous, lateness is allowed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "eye/running_eye.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/eye_socket.hpp"
#include "support/heap_guard.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

class BothTransports : public ::testing::TestWithParam<EyeTransport> {};
INSTANTIATE_TEST_SUITE_P(EyeLink, BothTransports,
                         ::testing::Values(EyeTransport::kSharedMemory, EyeTransport::kSocket),
                         [](const auto& one) {
                           return one.param == EyeTransport::kSocket ? "Socket" : "SharedMemory";
                         });

TEST_P(BothTransports, PowersGoOutAndTemperaturesComeBack) {
  RunningEye eye;
  {
    EyeDevice device(eye.link(GetParam()));
    EXPECT_EQ(device.pulses_per_period(), 10);
    device.prepare(GrueneisenCurve(water_like_curve()), {}, 200);
    device.begin(60);
    device.write_power(0.02, 1);
    double last = 0.0;
    int lit = 0;
    std::uint64_t token = 1;
    for (std::uint64_t cycle = 0; cycle < 60; ++cycle) {
      const DeviceSample sample = device.wait_sample(cycle);
      ASSERT_EQ(sample.status, DeviceStatus::kGood);
      EXPECT_EQ(sample.sequence, cycle + 1);
      const Readback readback = device.readback();
      if (readback.power > 0.0) ++lit;
      // A period with both powers is one whose command came late.
      EXPECT_EQ(readback.command, readback.power);
      EXPECT_LE(readback.command, 0.02);
      if (std::isfinite(sample.volume_temperature)) last = sample.volume_temperature;
      EXPECT_TRUE(device.readback().interlock_closed);
      device.write_power(0.02, ++token);
    }
    const auto& truth = device.finish_truth();
    ASSERT_EQ(truth.size(), 60u);
    EXPECT_GT(lit, 0) << "a busy machine may lose many";
    if (lit == 60) {
      EXPECT_GT(last, 8.0) << "some 12 K";
      // The pulse's own heat, averaged over its period, is in the truth only; noise 0.29 K.
      EXPECT_NEAR(last, truth.back().outputs.volume, 3.0);
      EXPECT_GT(truth.back().peak_pulse, truth.back().outputs.peak);
    }
  }
  eye.end();
  EXPECT_GT(eye.statistics().pulses, 800u);
  EXPECT_NE(to_text(eye.statistics()).find("answered late"), std::string::npos);
}

TEST_P(BothTransports, ACommandThatComesLateIsSaidToBe) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  constexpr std::uint64_t kPatience = 4000;  // 20 s
  device.begin(kPatience);
  device.write_power(0.02, 1);
  int late = 0;
  double command = 0.02;
  // A busy machine makes most of them too late for a mean.
  for (std::uint64_t cycle = 0; cycle < kPatience && late < 3; ++cycle) {
    device.wait_sample(cycle);
    const double in_force = device.readback().command;
    if (cycle > 0 && in_force > 0.011 && in_force < 0.019) ++late;
    // Half a period too late.
    wait_until(monotonic_ns() + static_cast<std::int64_t>(0.5e9 * kPeriod));
    command = command == 0.02 ? 0.01 : 0.02;
    device.write_power(command, cycle + 2);
  }
  EXPECT_EQ(late, 3);
}

TEST_P(BothTransports, ASecondControllerIsRefusedAndALaterOneWelcome) {
  RunningEye eye;
  for (int i = 0; i < 2; ++i) {
    std::optional<EyeDevice> first;
    // The one before has gone when the eye has noticed it: at its next pulse.
    for (int tries = 0; tries < 1000 && !first; ++tries) {
      try {
        first.emplace(eye.link(GetParam()));
      } catch (const Error&) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    ASSERT_TRUE(first);
    EXPECT_NE(message_of([&] { EyeDevice second(eye.link(GetParam())); }).find("another"),
              std::string::npos);
  }
}

TEST_P(BothTransports, SafeOffAndTheEndOfTheConnectionAreDark) {
  RunningEye eye;
  const Mapped<const EyeSharedMemory> memory = observe_eye(eye.socket());
  const EyeSharedMemory& seen = *memory;
  const auto dark = [&] {
    // Three pulses from now on at the latest.
    const std::uint64_t now = seen.pulses.load();
    while (seen.pulses.load() < now + 6) std::this_thread::yield();
    return seen.records[(now + 4) % kEyeRing].power_readback == 0.0;
  };
  {
    EyeDevice device(eye.link(GetParam()));
    device.begin(10);
    device.write_power(0.02, 1);
    device.safe_off();
    EXPECT_TRUE(dark());
    device.write_power(0.02, 2);
    EXPECT_TRUE(dark());
    // Where the machine was late, the first samples are of periods before the request.
    bool closed = true;
    for (std::uint64_t cycle = 0; cycle < 1000 && closed; ++cycle) {
      device.wait_sample(cycle);
      closed = device.readback().interlock_closed;
    }
    EXPECT_FALSE(closed);
  }
  eye.wait_until_free();
  {
    EyeDevice device(eye.link(GetParam()));
    device.begin(10);
    device.write_power(0.02, 1);
  }
  EXPECT_TRUE(dark());
}

TEST_P(BothTransports, AnEyeThatEndsIsGone) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  device.begin(10);
  eye.end();
  DeviceStatus status = DeviceStatus::kGood;
  for (std::uint64_t cycle = 0; cycle < 10 && status == DeviceStatus::kGood; ++cycle) {
    status = device.wait_sample(cycle).status;
  }
  EXPECT_EQ(status, DeviceStatus::kGone);
}

TEST_P(BothTransports, TheLoopsCallsAllocateNothing) {
  RunningEye eye;
  EyeDevice device(eye.link(GetParam()));
  device.prepare(GrueneisenCurve(water_like_curve()), {}, 50);
  device.begin(10);
  const HeapGuard guard;
  for (std::uint64_t cycle = 0; cycle < 5; ++cycle) {
    device.write_power(0.01, cycle + 1);
    device.wait_sample(cycle);
    device.readback();
    device.heartbeat(cycle);
  }
  device.safe_off();
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
}

TEST(EyeLink, LinesOfText) {
  RunningEye eye;
  EXPECT_NE(command_eye(eye.socket(), "status").find("pulses="), std::string::npos);
  EXPECT_EQ(command_eye(eye.socket(), "cold"), "ok");
  EXPECT_EQ(command_eye(eye.socket(), "fault M2@120"), "ok");
  EXPECT_NE(command_eye(eye.socket(), "fault X7@1").find("refused"), std::string::npos);
  EXPECT_NE(command_eye(eye.socket(), "open sesame").find("refused"), std::string::npos);
  EXPECT_NE(command_eye(eye.socket(), std::string(900, '\x7f')).find("refused"), std::string::npos);
  EXPECT_NE(message_of([] { command_eye("/no/such/eye", "status"); }).find("/no/such/eye"),
            std::string::npos);
}

TEST(EyeLink, OnceEndsWithItsFirstController) {
  RunningEye eye(true);
  { EyeDevice device(eye.link(EyeTransport::kSharedMemory)); }
  EXPECT_TRUE(eye.ended_by_itself());
}

TEST(EyeLink, APeriodThatIsNoWholeNumberOfPulsesIsRefused) {
  RunningEye eye;
  EyeLinkSettings settings = eye.link(EyeTransport::kSharedMemory);
  settings.period = 0.7e-3;
  EXPECT_NE(message_of([&] { EyeDevice device(settings); }).find("whole fraction"),
            std::string::npos);
}

TEST(EyeLink, GarbageOnTheSocketHurtsNobody) {
  RunningEye eye;
  for (std::size_t size : {1U, 4U, 16U, 24U, 1000U}) {
    const int socket = connect_to(eye.socket());
    const std::string garbage(size, '\x01');
    send_message(socket, garbage.data(), garbage.size());
    close(socket);
  }
  EXPECT_NE(command_eye(eye.socket(), "status").find("attached=0"), std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
