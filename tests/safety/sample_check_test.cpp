#include "photocoag/safety/sample_check.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "estimation/test_models.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

/// A cold eye at 0 W: every sample is noise.
struct Samples {
  SafetyLimits limits;
  SafetyLatch latch;
  MultiModelObserver observer{observer_for(model_1khz()), 0.288, 0.01};
  SampleCheck check;
  std::int64_t cycle = 0;
  Samples() { latch.status.state = SafetyState::kTreating; }

  DeviceSample good() {
    ++cycle;
    DeviceSample s;
    s.status = DeviceStatus::kGood;
    s.volume_temperature = cycle % 2 == 0 ? 0.1 : -0.1;
    s.raw = cycle;
    s.sequence = static_cast<std::uint64_t>(cycle);
    s.time_ns = s.now_ns = cycle * 1'000'000;
    return s;
  }
  SafetyReason judge(const DeviceSample& s) { return check.check(s, observer, limits, latch); }
  template <typename Spoil>
  SafetyReason spoiled(const Spoil& spoil) {
    DeviceSample s = good();
    spoil(s);
    return judge(s);
  }
  bool treating() const { return latch.status.state == SafetyState::kTreating; }
  /// The spoiled sample that stops is number …
  template <typename Spoil>
  int stops_at(const Spoil& spoil) {
    for (int k = 0; k < 30; ++k) judge(good());
    for (int k = 1; k <= 50; ++k) {
      spoiled(spoil);
      if (!treating()) return k;
    }
    return 0;
  }
};

TEST(SampleCheck, GoodSamplesAreUsed) {
  Samples s;
  for (int k = 0; k < 200; ++k) ASSERT_EQ(s.judge(s.good()), SafetyReason::kNone) << k;
  EXPECT_EQ(s.latch.status.detections, 0);
}

TEST(SampleCheck, EachKindStopsAfterItsOwnCount) {
  const auto missing = [](DeviceSample& s) { s.status = DeviceStatus::kTimeout; };
  const auto no_number = [](DeviceSample& s) {
    s.volume_temperature = std::numeric_limits<double>::quiet_NaN();
  };
  const auto stale = [](DeviceSample& s) { s.time_ns -= 1'600'000; };
  const auto from_the_future = [](DeviceSample& s) { s.time_ns += 200'000; };
  const auto repeated = [](DeviceSample& s) { s.sequence = 1; };
  const auto saturated = [](DeviceSample& s) { s.saturated = true; };
  const auto far_off = [](DeviceSample& s) { s.volume_temperature = 25.0; };
  const auto stuck = [](DeviceSample& s) { s.raw = 12345; };
  EXPECT_EQ(Samples().stops_at(missing), kMissingMax + 1);
  EXPECT_EQ(Samples().stops_at(no_number), kMissingMax + 1);
  EXPECT_EQ(Samples().stops_at(stale), kMissingMax + 1);
  EXPECT_EQ(Samples().stops_at(from_the_future), kMissingMax + 1);
  EXPECT_EQ(Samples().stops_at(repeated), kMissingMax + 1);
  EXPECT_EQ(Samples().stops_at(saturated), kSaturatedMax + 1);
  EXPECT_EQ(Samples().stops_at(far_off), kRejectedMax + 1);
  EXPECT_EQ(Samples().stops_at(stuck), kSameRawMax);
  // Below each bound nothing happens.
  EXPECT_EQ(Samples().stops_at([](DeviceSample& s) { s.time_ns -= 1'400'000; }), 0);
  EXPECT_EQ(Samples().stops_at([](DeviceSample& s) { s.volume_temperature = 0.9; }), 8)
      << "3 standard deviations: one by one plausible, together not the calibrated noise";
}

TEST(SampleCheck, RejectedOnesCountAmongTwentyAndOthersInARow) {
  Samples s;
  const auto far_off = [](DeviceSample& d) { d.volume_temperature = -10.0; };
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(s.spoiled(far_off), SafetyReason::kSampleRejected);
    for (int j = 0; j < 9; ++j) EXPECT_EQ(s.judge(s.good()), SafetyReason::kNone);
  }
  EXPECT_TRUE(s.treating()) << "two among twenty";
  s.spoiled(far_off);
  s.spoiled(far_off);
  EXPECT_FALSE(s.treating()) << "a third: as measurement noise, which is looked at first";
}

TEST(SampleCheck, AnOverrunOfOursIsNotTheDevicesFault) {
  Samples s;
  for (int k = 0; k < 30; ++k) {
    EXPECT_EQ(s.spoiled([](DeviceSample& d) { d.periods_behind = 1; }), SafetyReason::kOverrun);
  }
  EXPECT_EQ(s.latch.status.detections, 0) << "the check of the clock counts it";
}

TEST(SampleCheck, ANoiseFreeEyeMayBeStuck) {
  Samples s;
  s.limits.check_quiet = 0;
  for (int k = 0; k < 50; ++k) s.spoiled([](DeviceSample& d) { d.raw = 7; });
  EXPECT_TRUE(s.treating());
}

}  // namespace
}  // namespace photocoag::testing
