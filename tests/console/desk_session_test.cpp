// What the operator of a session may choose, who may, and what never starts by itself.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "console/consoles.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;

struct Bare {
  explicit Bare(bool browser_starts = true)
      : desk({.browser_starts = browser_starts,
              .period = 1e-3,
              .stop = [this] { stop = true; },
              .resume = [this] { stop = false; },
              .before = {}}),
        hooks(desk.hooks(nullptr, nullptr)) {
    hooks.came(1);
    hooks.came(2);
  }
  std::string why(int client, std::string_view name) {
    return Json::parse(hooks.said(client, command(name)))["why"];
  }
  Json newest(const std::string& type) {
    Json found;
    for (const std::string& text : hooks.tick()) {
      Json message = Json::parse(text);
      if (message["type"] == type) found = std::move(message);
    }
    return found;
  }
  void session() {
    desk.tell_session(R"({"type":"session"})");
    desk.stand_by();
  }
  bool stop = false;
  Desk desk;
  ServerHooks hooks;
};

TEST(DeskSession, OnlyWhatIsOfferedIsTakenAndOnlyOfTheOperator) {
  Bare bare;
  bare.session();
  EXPECT_EQ(bare.why(1, "accept"), "not now");
  EXPECT_EQ(bare.why(1, "explode"), "no such command");
  bare.desk.offer({"skip", "end", "repeat"}, {"A1", "A2"});
  const Json role = bare.newest("role");
  EXPECT_EQ(role["choices"], (Json{"skip", "end", "repeat"}));
  EXPECT_EQ(role["spots"], (Json{"A1", "A2"}));
  EXPECT_EQ(bare.why(2, "skip"), "this tab only watches");
  EXPECT_EQ(bare.why(1, "accept"), "not now");
  EXPECT_EQ(bare.why(1, "repeat"), "which spot?");
  EXPECT_EQ(bare.why(1, "repeat B9"), "no such spot");
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kNone);
  EXPECT_EQ(bare.why(1, "repeat A2"), "");
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kChoice);
  EXPECT_EQ(bare.desk.choice(), "repeat A2");
  EXPECT_EQ(bare.why(1, "skip"), "");
  bare.desk.offer({"accept"});
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kNone) << "what was chosen of another offer is void";
}

TEST(DeskSession, WhatWasStartedIsGivenUpUntilItBegins) {
  for (const char* how : {"leaves", "stop", "disarm", "release"}) {
    Bare bare;
    bare.session();
    EXPECT_EQ(bare.why(1, "arm"), "");
    EXPECT_EQ(bare.why(1, "start"), "");
    EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kStart);
    // The pause between two spots: the operator is gone, or has thought better of it.
    if (how == std::string("leaves")) {
      bare.hooks.left(1);
    } else {
      EXPECT_EQ(bare.why(1, how), "");
    }
    EXPECT_FALSE(bare.desk.commit()) << how;
    EXPECT_EQ(bare.desk.state(), SafetyState::kStandby) << how;
  }
}

TEST(DeskSession, AStopRightBeforeASpotIsNotTakenBack) {
  Bare bare;
  bare.session();
  bare.why(1, "arm");
  bare.why(1, "start");
  bare.desk.wait(0ms);
  ASSERT_TRUE(bare.desk.commit());
  EXPECT_EQ(bare.why(2, "stop"), "");
  EXPECT_EQ(bare.why(1, "arm"), "a spot begins");
  EXPECT_EQ(bare.why(1, "run_on"), "");
  EXPECT_TRUE(bare.stop);
  bare.desk.begin({.number = 1, .planned_cycles = 10});
  EXPECT_EQ(bare.why(1, "run_on"), "");
  EXPECT_TRUE(bare.stop) << "nor of a spot that runs";
}

TEST(DeskSession, SpotAfterSpotEndsWithStopAndWithItsOperator) {
  for (const bool leaves : {false, true}) {
    Bare bare;
    EXPECT_EQ(bare.why(1, "run_on"), "there is no session");
    bare.session();
    EXPECT_EQ(bare.why(2, "run_on"), "this tab only watches");
    EXPECT_EQ(bare.why(1, "run_on"), "");
    EXPECT_TRUE(bare.newest("role")["run_on"]);
    EXPECT_TRUE(bare.desk.commit());
    bare.desk.begin({.number = 1, .planned_cycles = 10});
    EXPECT_TRUE(bare.desk.runs_on());
    if (leaves) {
      bare.hooks.left(1);
    } else {
      EXPECT_EQ(bare.why(2, "stop"), "");
    }
    EXPECT_FALSE(bare.desk.runs_on());
    bare.desk.over(SafetyState::kDone, SafetyReason::kNone);
    EXPECT_FALSE(bare.desk.commit()) << "no next one";
    EXPECT_FALSE(bare.newest("role")["run_on"]);
  }
}

TEST(DeskSession, ABrowserChoosesButNeverStartsADevice) {
  Bare bare(false);
  bare.session();
  bare.desk.offer({"skip"});
  EXPECT_EQ(bare.why(1, "run_on"), "a device is started at the terminal, not by a browser");
  EXPECT_EQ(bare.why(1, "start"), "a device is started at the terminal, not by a browser");
  EXPECT_FALSE(bare.desk.commit());
  EXPECT_EQ(bare.why(1, "skip"), "") << "which emits nothing";
  bare.desk.enter();
  EXPECT_EQ(bare.desk.wait(0ms), Desk::Wish::kStart);
  bare.hooks.left(1);
  EXPECT_TRUE(bare.desk.commit()) << "who stands at the terminal has not left";
}

TEST(DeskSession, WhoComesLaterIsToldAndOnlyTheNewestIsSent) {
  Bare bare;
  for (int k = 0; k < 100; ++k) {
    bare.desk.tell_session(R"({"type":"session","k":)" + std::to_string(k) + "}");
  }
  int told = 0;
  for (const std::string& text : bare.hooks.tick()) {
    told += text.find("\"session\"") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(told, 1);
  EXPECT_EQ(bare.newest("session"), Json()) << "once";
  const std::vector<std::string> first = bare.hooks.came(3);
  EXPECT_EQ(Json::parse(first.back())["k"], 99);
}

}  // namespace
}  // namespace photocoag::testing
