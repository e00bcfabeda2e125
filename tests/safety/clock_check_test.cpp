#include "photocoag/safety/clock_check.hpp"

#include <gtest/gtest.h>

namespace photocoag {
namespace {

struct Clock {
  SafetyLimits limits;
  SafetyLatch latch;
  ClockCheck check;
  explicit Clock(std::int64_t in_a_row = 100, std::int64_t per_hundred = 100) {
    limits.overruns_in_a_row_max = in_a_row;
    limits.overruns_per_hundred = per_hundred;
    latch.status.state = SafetyState::kTreating;
  }
  bool treating() const { return latch.status.state == SafetyState::kTreating; }
  /// Cycles of a kind until it stops, at most 1,000.
  int cycles_of(std::uint32_t behind, bool late) {
    for (int k = 1; k <= 1000; ++k) {
      check.check({.periods_behind = behind}, late, limits, latch);
      if (!treating()) return k;
    }
    return 1000;
  }
};

TEST(ClockCheck, TimelyCyclesAreNotNoticed) {
  Clock clock(0, 0);
  EXPECT_EQ(clock.cycles_of(0, false), 1000);
  EXPECT_EQ(clock.latch.status.detections, 0);
}

TEST(ClockCheck, TheFourthLateCommandInARowStops) {
  Clock clock;
  for (int k = 0; k < kLateCommandsMax; ++k) clock.check.check({}, true, clock.limits, clock.latch);
  clock.check.check({}, false, clock.limits, clock.latch);
  EXPECT_TRUE(clock.treating());
  EXPECT_EQ(clock.latch.status.late_commands, kLateCommandsMax);
  EXPECT_EQ(clock.cycles_of(0, true), kLateCommandsMax + 1) << "a timely one begins anew";
  EXPECT_EQ(clock.latch.status.reason, SafetyReason::kCommandLate);
  EXPECT_TRUE(clock.latch.open_interlock);
}

TEST(ClockCheck, OverrunsStopByTheRowAndByTheHundred) {
  Clock row(1, 100);
  EXPECT_EQ(row.cycles_of(1, false), 2);
  EXPECT_EQ(row.latch.status.reason, SafetyReason::kOverrun);
  Clock late_as_well(1, 100);
  EXPECT_EQ(late_as_well.cycles_of(0, true), 2);
  // The second within a hundred periods, not a hundred and one.
  for (const int apart : {99, 100}) {
    Clock hundred(1, 1);
    hundred.check.check({.periods_behind = 1}, false, hundred.limits, hundred.latch);
    for (int k = 1; k < apart; ++k) {
      hundred.check.check({}, false, hundred.limits, hundred.latch);
    }
    hundred.check.check({.periods_behind = 1}, false, hundred.limits, hundred.latch);
    EXPECT_EQ(hundred.treating(), apart == 100) << apart;
  }
}

}  // namespace
}  // namespace photocoag
