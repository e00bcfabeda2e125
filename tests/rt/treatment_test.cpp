// A treatment paced by the clock does what the same treatment does in virtual time.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "loop/treatments.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

struct Case {
  Config config = shipped("paper-1khz.toml", {"run.duration_ms=30", "grid.min_cells=10000"});
  ModelStore models{config, false};
};

TEST(PacedTreatment, HasTheRecordsOfVirtualTimeIfNothingOverran) {
  Case c;
  const Treatment expected = treat(c.config, c.models);
  // On a busy machine some attempts overrun; that is no fault of the program.
  for (int attempt = 0; attempt < 20; ++attempt) {
    const Treatment paced = treat(c.config, c.models, DeviceAddress());
    // A very busy machine: the supervisor has stopped for overruns.
    if (paced.outcome.safety.reason == SafetyReason::kOverrun) continue;
    ASSERT_EQ(paced.records.size(), 30u) << "overrun or not, every cycle is recorded";
    ASSERT_FALSE(paced.outcome.stopped);
    ASSERT_FALSE(paced.scheduling.empty());
    // AddressSanitizer, which brings its own malloc, says yes to mlockall and locks nothing.
    if (paced.scheduling.find("memory locked") != std::string::npos && heap_guard_sees_malloc()) {
      EXPECT_EQ(paced.page_faults.minor + paced.page_faults.major, 0);
    }
    // It does not run ahead of the clock: 30 periods of 1 ms.
    ASSERT_GE(paced.wall_seconds, 0.030);
    if (paced.outcome.overruns > 0) continue;
    ASSERT_EQ(paced.timing.wake_late.size(), 30u);
    ASSERT_EQ(paced.timing.cycle.size(), 30u);
    EXPECT_TRUE(same(paced.records, expected.records));
    return;
  }
  GTEST_SKIP() << "the machine overran in every attempt";
}

TEST(PacedTreatment, AStopFromAnotherThreadEndsAtZero) {
  Case c;
  c.models.reduced();
  c.models.plant_full();
  c.config = shipped("paper-1khz.toml", {"run.duration_ms=5000", "grid.min_cells=10000"});
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> progress{0};
  std::thread user([&] {
    while (progress.load() < 5) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    stop = true;
  });
  const Treatment treatment = run_treatment(c.config, c.models, DeviceAddress(), stop, progress);
  user.join();
  EXPECT_TRUE(treatment.outcome.stopped);
  ASSERT_GE(treatment.records.size(), 6u);
  // Far from the 5000 cycles that were asked for, whatever the machine's load.
  EXPECT_LT(treatment.records.size(), 4000u);
  EXPECT_EQ(treatment.records.back().power, 0.0);
  EXPECT_EQ(treatment.records.back().decision.status, MpcStatus::kStopped);
  EXPECT_EQ(progress.load(), treatment.records.size());
}

}  // namespace
}  // namespace photocoag::testing
