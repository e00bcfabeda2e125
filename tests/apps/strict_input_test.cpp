// Input that is almost right: numbers that are none, bytes after the end, marks in front.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

const std::string kCoarse = " --set grid.min_cells=2000 --set run.duration_ms=20";
const std::string kMark = "\xEF\xBB\xBF";

TEST(StrictInput, EveryNumberOnTheCommandLineIsFiniteAndWhole) {
  const Sandbox sandbox;
  const std::vector<std::string> numbers = {
      "response --model full --times 0.001 --power ",
      "field --times 0.001 --out field --power ",
      "latency --seconds ",
      "latency --seconds 0.01 --period-ms ",
      "estimation --seeds ",
      "faults --row M1 --healthy ",
      "faults --kills ",
      "faults --stops ",
      "faults --row X3 --allocation-step ",
      "spots --count ",
      "spots --count 1 --alpha-low ",
      "spots --count 1 --alpha-high ",
      "calibrate heating.csv --degree ",
      "calibrate --example heating.csv --rows ",
      "sweep --vary control.horizon=2 --seeds ",
      "reproduce --quick --out paper --seeds ",
      "campaign demo.toml --out demo --threads ",
      "campaign demo.toml --replay ",
      "reduce --out model.json --order ",
      "simulate --out run --seed ",
  };
  for (const std::string& option : numbers) {
    for (const char* value : {"nan", "inf", "-inf", "1e999", "1x", "''"}) {
      const ProgramResult result = sandbox.run(option + value, "timeout 20");
      EXPECT_EQ(result.exit_code, 2) << option << value << "\n" << result.err;
      EXPECT_EQ(sandbox.entries(), 0U) << option << value;
    }
  }
  EXPECT_EQ(sandbox.entries(), 0U);
}

TEST(StrictInput, WhatFaultsDoesNotKnowIsRefusedWithWhatIsAccepted) {
  const Sandbox sandbox;
  const ProgramResult row = sandbox.run("faults --row Z9", "timeout 20");
  EXPECT_EQ(row.exit_code, 2);
  EXPECT_NE(row.err.find("Z9; accepted: M1, M2"), std::string::npos) << row.err;
  for (const char* option : {"--healthy 0", "--kills 0", "--stops 0"}) {
    const ProgramResult none = sandbox.run(std::string("faults ") + option, "timeout 20");
    EXPECT_EQ(none.exit_code, 2) << option;
    EXPECT_NE(none.err.find("a whole number from 1"), std::string::npos) << none.err;
  }
}

TEST(StrictInput, ListsOfNumbersAreStrict) {
  const Sandbox sandbox;
  for (const std::string command :
       {"response --model full --power 1 --times ", "field --power 1 --out field --times ",
        "export --out matrices --alphas "}) {
    for (const char* list : {"''", "0,001,0,01", "0,001", "0.1,", ",0.1", "0.1,,0.2", "0.1,nan",
                             "0.1,0.1", "-1", "'0.1;0.2'", "inf"}) {
      const ProgramResult result = sandbox.run(command + list + kCoarse, "timeout 20");
      EXPECT_EQ(result.exit_code, 2) << command << list << "\n" << result.err;
    }
  }
  EXPECT_EQ(sandbox.entries(), 0U);
  const ProgramResult any_order =
      sandbox.run("response --model full --power 1 --times 0.01,0.001 --csv -" + kCoarse);
  EXPECT_EQ(any_order.exit_code, 0) << any_order.err;
}

TEST(StrictInput, BytesAfterAZeroByteAreNotLeftUnread) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("reduce --set grid.min_cells=2000 --out good.json").exit_code, 0);
  ASSERT_EQ(sandbox.run("simulate --out run" + kCoarse).exit_code, 0);
  ASSERT_EQ(sandbox.run("calibrate --example good.csv").exit_code, 0);
  const std::string zero("\0{", 2);
  write_all(sandbox.path("bad.json"), read_all(sandbox.path("good.json")) + zero);
  write_all(sandbox.path("bad.toml"), "[run]\nseed = 3\n" + zero);
  write_all(sandbox.path("bad.csv"), read_all(sandbox.path("good.csv")) + zero);
  fs::copy(sandbox.path("run"), sandbox.path("zero"));
  write_all(sandbox.path("zero/run.csv"), read_all(sandbox.path("run/run.csv")) + zero);
  for (const std::string command :
       {"simulate --out out --set model.file=bad.json", "simulate --out out --config bad.toml",
        "calibrate bad.csv", "convert zero --csv -", "replay zero", "compare zero run --out out"}) {
    const ProgramResult result = sandbox.run(command);
    EXPECT_EQ(result.exit_code, 2) << command;
    EXPECT_NE(result.err.find("a zero byte"), std::string::npos) << command << result.err;
  }
}

TEST(StrictInput, SpreadsheetsMayMarkAndQuoteTheirTables) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out run" + kCoarse).exit_code, 0);
  ASSERT_EQ(sandbox.run("calibrate --example plain.csv").exit_code, 0);
  const auto as_spreadsheet = [&](const char* from, const char* to) {
    std::string text = read_all(sandbox.path(from));
    std::string saved = kMark;
    bool header = true;
    for (const char c : text) {
      if (saved == kMark) saved += '"';
      if (header && (c == ',' || c == '\n')) saved += '"';
      if (c == '\n') saved += '\r';
      saved += c;
      header = header && c != '\n';
      if (header && c == ',') saved += '"';
    }
    write_all(sandbox.path(to), saved);
  };
  as_spreadsheet("plain.csv", "saved.csv");
  const ProgramResult curve = sandbox.run("calibrate saved.csv");
  EXPECT_EQ(curve.exit_code, 0) << curve.err;
  EXPECT_EQ(curve.out, sandbox.run("calibrate plain.csv").out);

  const std::string csv = read_all(sandbox.path("run/run.csv"));
  fs::copy(sandbox.path("run"), sandbox.path("saved"));
  as_spreadsheet("run/run.csv", "saved/run.csv");
  const ProgramResult converted = sandbox.run("convert saved --csv -");
  EXPECT_EQ(converted.out, csv) << converted.err;
  EXPECT_EQ(sandbox.run("replay saved").exit_code, 0);
  EXPECT_EQ(sandbox.run("compare run saved --out both").exit_code, 0);
  EXPECT_EQ(sandbox.run("field --run saved --times 0.01 --out field").exit_code, 0);

  write_all(sandbox.path("marked.toml"), kMark + "[run]\nduration_ms = 20\n");
  EXPECT_EQ(sandbox.run("config --config marked.toml").exit_code, 0);
  write_all(sandbox.path("twice.toml"), kMark + kMark + "[run]\nduration_ms = 20\n");
  const ProgramResult twice = sandbox.run("config --config twice.toml");
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_NE(twice.err.find("two byte order marks"), std::string::npos) << twice.err;
}

}  // namespace
}  // namespace photocoag::testing
