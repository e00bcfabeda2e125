// `driver-check`: the shipped example keeps every promise, and a driver that breaks one is caught
// by the line of that promise.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;
const std::string kPeriod = " --period-ms 2";

std::string verdict_of(const Json& json, const std::string& promise) {
  for (const Json& one : json["promises"]) {
    if (one["promise"] == promise) return one["verdict"].get<std::string>();
  }
  return "not there";
}

TEST(DriverCheck, TheExampleKeepsEveryPromise) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run(std::string("driver-check ") + PHOTOCOAG_EXAMPLE_DRIVER +
                                           " --failing fail=open --json" + kPeriod);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["promises"].size(), 15U);
  for (const Json& one : json["promises"]) EXPECT_EQ(one["verdict"], "kept") << one;
}

// With a stand-in for the vendor's library: a real driver, so that --light must be said.
TEST(DriverCheck, TheNidaqmxDriverKeepsEveryPromise) {
  const Sandbox sandbox;
  const std::string scales = "K_per_V=10 W_per_V=0.02 monitor_W_per_V=0.02";
  const std::string check = std::string("driver-check ") + PHOTOCOAG_NIDAQMX +
                            " --settings 'library=" + PHOTOCOAG_FAKE_NIDAQMX + " " + scales +
                            "' --failing device=Dev7 --json" + kPeriod;
  EXPECT_NE(sandbox.run(check).exit_code, 0) << "it may emit light";
  const ProgramResult result = sandbox.run(check + " --light");
  EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
  for (const Json& one : Json::parse(result.out)["promises"]) {
    EXPECT_EQ(one["verdict"], "kept") << one;
  }
}

TEST(DriverCheck, ABrokenPromiseFailsItsLine) {
  const Sandbox sandbox;
  const std::vector<std::pair<std::string, std::string>> faults = {
      {"open", "open"},         {"answer", "open"},          {"order", "order"},
      {"time", "order"},        {"early", "order"},          {"crash", "order"},
      {"late", "late"},         {"deadline", "deadline"},    {"deadline-loses", "deadline"},
      {"tokens", "tokens"},     {"powers", "powers"},        {"readback", "readback"},
      {"switches", "readback"}, {"watchdog", "watchdog"},    {"feeding", "feeding"},
      {"heartbeat", "feeding"}, {"safe-off", "safe-off"},    {"reopen", "reopen"},
      {"slow", "times"},        {"allocation", "allocation"}};
  for (const auto& [fault, promise] : faults) {
    const ProgramResult result =
        sandbox.run(std::string("driver-check ") + PHOTOCOAG_BROKEN_DRIVER +
                    " --settings break=" + fault + " --only " + promise + " --json" + kPeriod);
    EXPECT_EQ(result.exit_code, 1) << fault << result.err;
    EXPECT_EQ(verdict_of(Json::parse(result.out), promise), "BROKEN") << fault;
    const ProgramResult healthy = sandbox.run(
        std::string("driver-check ") + PHOTOCOAG_BROKEN_DRIVER + " --only " + promise + kPeriod);
    EXPECT_EQ(healthy.exit_code, 0) << "without the fault: " << healthy.out;
  }
  for (const std::string fault : {"message-beyond", "message-empty"}) {
    const ProgramResult result =
        sandbox.run(std::string("driver-check ") + PHOTOCOAG_BROKEN_DRIVER +
                    " --failing 'fail break=" + fault + "' --only message --json");
    EXPECT_EQ(result.exit_code, 1) << fault << result.err;
    EXPECT_EQ(verdict_of(Json::parse(result.out), "message"), "BROKEN") << fault;
  }
}

TEST(DriverCheck, ACallThatNeverReturnsEndsWithThePatience) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run(std::string("driver-check ") + PHOTOCOAG_BROKEN_DRIVER +
                                           " --settings break=hang --only watchdog --patience 0.5");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.out.find("a call does not return"), std::string::npos) << result.out;
}

TEST(DriverCheck, WhatIsNoDriverAndWhatDoesNotOpen) {
  const Sandbox sandbox;
  const std::string check = "driver-check ";
  EXPECT_EQ(sandbox.run(check + "no-such-file.so").exit_code, 2);
  const ProgramResult table = sandbox.run(check + PHOTOCOAG_BROKEN_TABLE_DRIVER);
  EXPECT_EQ(table.exit_code, 1);
  EXPECT_NE(table.out.find("version 3 instead of 2"), std::string::npos) << table.out;
  const ProgramResult closed =
      sandbox.run(check + PHOTOCOAG_EXAMPLE_DRIVER + " --settings fail=open");
  EXPECT_EQ(closed.exit_code, 3);
  EXPECT_NE(closed.err.find("asked to fail by its settings"), std::string::npos) << closed.err;
  // Light could come out of this one.
  const ProgramResult real = sandbox.run(check + PHOTOCOAG_REAL_DRIVER);
  EXPECT_EQ(real.exit_code, 2);
  EXPECT_NE(real.err.find("--light"), std::string::npos) << real.err;
  EXPECT_EQ(sandbox.run(check + PHOTOCOAG_REAL_DRIVER + " --light --only order").exit_code, 0);
  EXPECT_EQ(sandbox.run(check + PHOTOCOAG_EXAMPLE_DRIVER + " --only everything").exit_code, 2);
}

}  // namespace
}  // namespace photocoag::testing
