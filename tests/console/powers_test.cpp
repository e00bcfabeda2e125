// What a server and its clients change of a treatment: nothing. And what STOP changes: at once.
#include <gtest/gtest.h>

#include <bit>
#include <thread>

#include "console/consoles.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag::testing {
namespace {

struct Eye {
  Config config = load_config("", {"grid.min_cells=2000", "run.duration_ms=1000"});
  ModelStore models{config, true};

  Treatment treat(const std::atomic<bool>& stop, const TreatmentMonitor& monitor = {}) {
    std::atomic<std::size_t> done{0};
    return run_treatment(config, models, virtual_eye(), stop, done, {}, {}, monitor);
  }
};

void expect_same_powers(const Treatment& one, const Treatment& other) {
  ASSERT_EQ(one.records.size(), other.records.size());
  for (std::size_t k = 0; k < one.records.size(); ++k) {
    ASSERT_EQ(std::bit_cast<std::uint64_t>(one.records[k].power),
              std::bit_cast<std::uint64_t>(other.records[k].power))
        << "cycle " << k;
  }
}

// Twenty treatments while clients come, misbehave and go: the same bits as without observer.
TEST(ConsolePowers, AreTheSameToTheLastBitWithHostileClients) {
  Eye eye;
  const std::atomic<bool> never{false};
  const Treatment alone = eye.treat(never);
  Console console;
  std::atomic<bool> over{false};
  std::thread attackers([&] {
    while (!over) {
      std::vector<RawClient> crowd;
      for (int k = 0; k < 20; ++k) {
        try {
          crowd.emplace_back(console.server->port(), 1024);
          crowd.back().upgrade({.token = console.token, .origin = {}, .host = {}});
          crowd.back().send(k % 2 == 0 ? web_frame(1, std::string(100'000, 'a'))
                                       : web_frame(1, command("start")));
        } catch (const Error&) {  // refused
        }
      }
    }
  });
  console.desk.begin({.number = 1, .planned_cycles = 1000});
  for (int k = 0; k < 20; ++k) {
    expect_same_powers(alone, eye.treat(never, {.live = &console.desk.live(), .self_tested = {}}));
  }
  over = true;
  attackers.join();
  EXPECT_GT(console.server->refusals().total(), 0U);
}

// Nobody empties the ring: the server is dead.
TEST(ConsolePowers, AreTheSameWithADeadServer) {
  Eye eye;
  const std::atomic<bool> never{false};
  const Treatment alone = eye.treat(never);
  Console console;
  console.server->stop();
  EXPECT_FALSE(console.server->alive());
  expect_same_powers(alone, eye.treat(never, {.live = &console.desk.live(), .self_tested = {}}));
}

TEST(ConsolePowers, TheSelfTestIsToldBeforeTheLoop) {
  Eye eye;
  const std::atomic<bool> never{false};
  int told = 0;
  eye.treat(never, {.live = nullptr,
                    .self_tested = [&](const SelfTestReport& report, const SafetyLimits& limits) {
                      ++told;
                      EXPECT_TRUE(failed_items(report, limits).empty());
                    }});
  EXPECT_EQ(told, 1);
}

// The period in which the flag is seen is the last with light, whenever STOP comes.
TEST(ConsolePowers, StopWritesZeroInThePeriodInWhichItIsSeen) {
  Eye eye;
  for (int attempt = 0; attempt < 20; ++attempt) {
    Console console;
    RawClient client = console.client();
    console.desk.begin({.number = 1, .planned_cycles = 1000});
    SpscRing<LogRecord> seen(4096);
    std::thread stopping([&] {
      // After more and more of the spot; always before its end, which the last ones do not reach.
      std::vector<LogRecord> some(64);
      for (int records = 0; records <= attempt * 10;) records += static_cast<int>(seen.pop(some));
      client.say(command("stop"));
    });
    const Treatment treatment = eye.treat(console.stop, {.live = &seen, .self_tested = {}});
    stopping.join();
    if (!treatment.outcome.stopped) continue;  // it was over before
    ASSERT_GE(treatment.records.size(), 2U);
    EXPECT_EQ(treatment.records.back().power, 0.0);
    EXPECT_EQ(treatment.records.back().decision.status, MpcStatus::kStopped);
    EXPECT_NE(treatment.records[treatment.records.size() - 2].decision.status, MpcStatus::kStopped);
  }
}

}  // namespace
}  // namespace photocoag::testing
