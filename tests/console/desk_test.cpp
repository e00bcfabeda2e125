// Who may do what at the console, and what its clients are told.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "console/consoles.hpp"
#include "photocoag/console/messages.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/run/reasons.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;

/// A desk without a server: the hooks are called by hand.
struct Bare {
  explicit Bare(bool browser_starts = true)
      : desk({.browser_starts = browser_starts,
              .period = 1e-3,
              .stop = [this] { stop = true; },
              .resume = [this] { stop = false; },
              .before = R"({"type":"before"})"}),
        hooks(desk.hooks(nullptr, nullptr)) {}
  std::string why(int client, std::string_view name) {
    return Json::parse(hooks.said(client, command(name)))["why"];
  }
  Json live() { return Json::parse(hooks.tick().front()); }
  Json role() {
    for (const std::string& text : hooks.tick()) {
      if (text.find("\"role\"") != std::string::npos) return Json::parse(text);
    }
    return {};
  }
  bool stop = false;
  Desk desk;
  ServerHooks hooks;
};

LogRecord record(std::int64_t cycle, double power) {
  LogRecord record;
  record.cycle = cycle;
  record.time = static_cast<double>(cycle + 1) * 1e-3;
  record.power = power;
  record.end.next_power = power;
  return record;
}

TEST(Desk, OneTabOperatesTheOthersWatchAndAnyStops) {
  Bare bare;
  bare.desk.self_tested(good_self_test(), some_limits());
  bare.hooks.came(1);
  bare.hooks.came(2);
  EXPECT_EQ(bare.role()["operator"], 1);
  EXPECT_EQ(bare.why(2, "arm"), "this tab only watches");
  EXPECT_EQ(bare.why(2, "operate"), "another tab operates");
  EXPECT_EQ(bare.why(1, "arm"), "");
  EXPECT_EQ(bare.desk.state(), SafetyState::kReady);
  EXPECT_EQ(bare.why(2, "stop"), "");
  EXPECT_TRUE(bare.stop);
  EXPECT_EQ(bare.desk.state(), SafetyState::kStandby) << "STOP disarms";
  bare.hooks.left(1);
  EXPECT_EQ(bare.why(2, "arm"), "this tab only watches") << "nobody operates by itself";
  EXPECT_EQ(bare.why(2, "operate"), "");
  EXPECT_EQ(bare.why(2, "arm"), "");
  EXPECT_FALSE(bare.stop) << "arming takes an old STOP back";
}

TEST(Desk, StartsOnlyWhatIsArmedAndNothingAfterStop) {
  Bare bare;
  bare.desk.self_tested(good_self_test(), some_limits());
  bare.hooks.came(1);
  EXPECT_EQ(bare.why(1, "start"), "not in standby");
  EXPECT_EQ(bare.why(1, "arm"), "");
  EXPECT_EQ(bare.why(1, "start"), "");
  EXPECT_EQ(bare.why(1, "stop"), "");
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kNone) << "STOP came before it began";
  EXPECT_EQ(bare.why(1, "arm"), "");
  EXPECT_EQ(bare.why(1, "start"), "");
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kStart);
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kNone) << "once";
}

TEST(Desk, AnOperatorWhoLeavesDisarms) {
  Bare bare;
  bare.desk.self_tested(good_self_test(), some_limits());
  bare.hooks.came(1);
  bare.why(1, "arm");
  bare.why(1, "start");
  bare.hooks.left(1);
  EXPECT_EQ(bare.desk.state(), SafetyState::kStandby);
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kNone);
  // A spot that runs goes on.
  bare.hooks.came(2);
  bare.desk.begin({.number = 1, .planned_cycles = 10});
  bare.hooks.left(2);
  EXPECT_EQ(bare.desk.state(), SafetyState::kTreating);
  EXPECT_FALSE(bare.stop);
}

TEST(Desk, NoBrowserStartsADevice) {
  Bare bare(false);
  bare.desk.stand_by();
  bare.hooks.came(1);
  for (const char* name : {"arm", "start", "reset", "disarm"}) {
    EXPECT_EQ(bare.why(1, name), "a device is started at the terminal, not by a browser") << name;
  }
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kNone);
  bare.desk.enter();
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kStart) << "the terminal does";
  EXPECT_EQ(bare.why(1, "stop"), "");
  EXPECT_TRUE(bare.stop) << "a browser stops it";
}

TEST(Desk, AFailedSelfTestCannotBeArmed) {
  Bare bare;
  SelfTestReport report = good_self_test();
  report.watchdog_tripped = false;
  bare.desk.self_tested(report, some_limits());
  bare.hooks.came(1);
  EXPECT_EQ(bare.desk.state(), SafetyState::kSafeStop);
  EXPECT_EQ(bare.why(1, "arm"), "not in safe_stop");
  const Json test = Json::parse(self_test_message(report, some_limits()));
  EXPECT_FALSE(test["passed"]);
  for (const Json& item : test["items"])
    EXPECT_EQ(item["good"], item["name"] != "Watchdog") << item;
}

TEST(Desk, RowsAreTheLogsAndGapsAreCounted) {
  Bare bare;
  bare.hooks.came(1);
  bare.desk.begin({.number = 1, .planned_cycles = 10});
  bare.hooks.tick();
  const Json columns = Json::parse(hello_message(1))["columns"];
  for (const std::int64_t cycle : {0, 1, 4}) bare.desk.live().push(record(cycle, 0.02));
  const Json live = bare.live();
  EXPECT_EQ(live["state"], "treating");
  EXPECT_EQ(live["rows"].size(), 3U);
  EXPECT_EQ(live["dropped"], 2);
  EXPECT_EQ(live["cycle"], 5);
  EXPECT_TRUE(live["emission"]);
  ASSERT_EQ(live["rows"][2].size(), columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Json& cell = live["rows"][2][i];
    if (columns[i]["name"] == "cycle") {
      EXPECT_EQ(cell, 4);
    } else if (columns[i]["name"] == "power_W") {
      EXPECT_EQ(cell, 0.02);
    } else if (columns[i]["name"] == "volume_measured_K") {
      EXPECT_TRUE(cell.is_null()) << "no sample";
    } else if (columns[i]["name"] == "safety_reason") {
      EXPECT_EQ(cell, "none");
    }
  }
  EXPECT_TRUE(bare.live()["rows"].empty()) << "each row once";
}

TEST(Desk, TheNewestDatumAgesWhileMoreIsDue) {
  Bare bare;
  bare.hooks.came(1);
  bare.desk.begin({.number = 1, .planned_cycles = 2});
  EXPECT_TRUE(bare.live()["age_ms"].is_null()) << "the device is tested";
  LogRecord running = record(0, 0.02);
  running.wake_late = 0;
  running.end.sample.now_ns = monotonic_ns() - 300'000'000;
  running.end.safety.state = SafetyState::kTreating;
  bare.desk.live().push(running);
  EXPECT_GE(bare.live()["age_ms"], 300.0);
  LogRecord last = running;
  last.cycle = 1;
  last.end.safety.state = SafetyState::kDone;
  bare.desk.live().push(last);
  EXPECT_TRUE(bare.live()["age_ms"].is_null()) << "the run folder is written";
}

TEST(Desk, TheLastRowsComeBeforeTheSummary) {
  Bare bare;
  bare.hooks.came(1);
  bare.desk.begin({.number = 1, .planned_cycles = 1});
  bare.hooks.tick();
  bare.desk.live().push(record(0, 0.02));
  bare.desk.end({.state = SafetyState::kDone, .message = R"({"type":"spot"})", .folder = "f"});
  const std::vector<std::string> messages = bare.hooks.tick();
  EXPECT_EQ(Json::parse(messages.front())["rows"].size(), 1U);
  EXPECT_EQ(messages.back(), R"({"type":"spot"})");
  EXPECT_FALSE(Json::parse(messages.front())["emission"]) << "it is over";
  EXPECT_EQ(bare.hooks.came(2).back(), R"({"type":"spot"})") << "who comes later sees it, too";
}

TEST(Desk, GivesOutTheRunFoldersFourFilesAndNothingElse) {
  Bare bare;
  const TemporaryFolder folder;
  write_file((folder.path() / "run.csv").string(), "cycle\n");
  write_file((folder.path() / "secret").string(), "s");
  bare.desk.begin({.number = 1, .planned_cycles = 1});
  bare.desk.end({.state = SafetyState::kDone, .message = "{}", .folder = folder.path()});
  EXPECT_EQ(bare.hooks.run_file("1/run.csv")->content, "cycle\n");
  for (const char* path : {"1/secret", "1/../run.csv", "2/run.csv", "0/run.csv", "-1/run.csv", "1",
                           "", "run.csv", "1/summary.json", "1/", "99999999999999999999/run.csv"}) {
    EXPECT_FALSE(bare.hooks.run_file(path)) << path;
  }
}

TEST(Desk, EveryReasonHasWords) {
  for (int k = 0; k <= static_cast<int>(SafetyReason::kCommandLate); ++k) {
    EXPECT_FALSE(words_of(static_cast<SafetyReason>(k)).what.empty()) << k;
  }
}

TEST(Desk, ACommandIsOneObjectWithOneWord) {
  EXPECT_EQ(command_of(R"({"command":"stop"})"), "stop");
  for (const char* text : {"", "stop", "{}", "[]", R"({"command":1})", R"({"command":"a","b":1})",
                           R"({"command":"stop"}x)", R"({"Command":"stop"})", "null"}) {
    EXPECT_FALSE(command_of(text)) << text;
  }
}

}  // namespace
}  // namespace photocoag::testing
