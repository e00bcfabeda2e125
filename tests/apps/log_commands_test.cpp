// The commands around the log and the machine, as a user calls them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;

const std::string kShort = " --set grid.min_cells=2000 --set run.duration_ms=60 ";

TEST(LogCommands, TreatIsConvertedForOtherPrograms) {
  const Sandbox sandbox;
  // 1: a busy machine may have stopped it for overruns; the log is there all the same.
  ASSERT_LE(sandbox.run("treat --out run" + kShort).exit_code, 1);
  const Json summary = Json::parse(read_all(sandbox.path("run/summary.json")));
  EXPECT_EQ(summary["log"]["produced"], summary["cycles"]);
  EXPECT_EQ(summary["log"]["dropped"], 0);
  EXPECT_TRUE(summary["log"]["alarm"].is_null());
  for (const char* name : {"wake_us", "compute_us", "write_us", "slack_us"}) {
    const Json& histogram = summary["histograms"][name];
    std::int64_t sum = histogram["below_0"].get<std::int64_t>() +
                       histogram["overflow"].get<std::int64_t>() +
                       histogram["without"].get<std::int64_t>();
    for (const Json& bin : histogram["bins"]) sum += bin[1].get<std::int64_t>();
    EXPECT_EQ(sum, summary["cycles"].get<std::int64_t>()) << name;
  }
  EXPECT_NE(read_all(sandbox.path("run/report.html")).find("slack"), std::string::npos);
  const ProgramResult result = sandbox.run("convert run --csv - --hdf5 run.h5 --mat run.mat");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'),
            1 + summary["cycles"].get<std::int64_t>());
  EXPECT_EQ(read_all(sandbox.path("run.h5")).substr(1, 3), "HDF");
  EXPECT_EQ(read_all(sandbox.path("run.mat")).substr(0, 10), "MATLAB 5.0");
}

TEST(LogCommands, ARunFolderIsRecoveredByteByByte) {
  const Sandbox sandbox;
  ASSERT_LE(sandbox.run("treat --out run" + kShort).exit_code, 1);
  const std::string csv = read_all(sandbox.path("run/run.csv"));
  EXPECT_EQ(sandbox.run("convert run --recover").exit_code, 2) << "it is complete";
  for (const char* file : {"run/run.csv", "run/summary.json", "run/report.html"}) {
    std::filesystem::remove(sandbox.path(file));
  }
  const ProgramResult result = sandbox.run("convert run --recover");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(read_all(sandbox.path("run/run.csv")), csv);
  EXPECT_TRUE(std::filesystem::exists(sandbox.path("run/report.html")));
}

TEST(LogCommands, SimulatedRunsAreConvertedFromTheirTable) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out run" + kShort).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(sandbox.path("run/log")));
  const ProgramResult result = sandbox.run("convert run --csv -");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, read_all(sandbox.path("run/run.csv")));
}

TEST(LogCommands, BadInputIsRefused) {
  const Sandbox sandbox;
  write_all(sandbox.path("text.seg"), "no segment");
  for (const std::string command :
       {"convert", "convert absent --csv -", "convert text.seg --csv -", "convert text.seg",
        "convert text.seg --recover", "latency --seconds -1", "latency --period-ms 0"}) {
    const ProgramResult result = sandbox.run(command);
    EXPECT_EQ(result.exit_code, 2) << command << ": " << result.err;
    EXPECT_FALSE(result.err.empty()) << command;
  }
}

TEST(MachineCommands, DoctorAndLatencyPrintJson) {
  const Sandbox sandbox;
  const ProgramResult doctor = sandbox.run("doctor --json -");
  EXPECT_LE(doctor.exit_code, 1);
  const Json findings = Json::parse(doctor.out);
  EXPECT_GE(findings.size(), 10u);
  for (const Json& finding : findings) {
    EXPECT_TRUE(finding["health"] == "good" || !finding["advice"].get<std::string>().empty());
  }
  const ProgramResult latency = sandbox.run("latency --seconds 0.1 --json -");
  ASSERT_EQ(latency.exit_code, 0) << latency.err;
  const Json json = Json::parse(latency.out);
  EXPECT_EQ(json["photocoag"]["wakes"].get<int>() + json["photocoag"]["periods_missed"].get<int>(),
            100);
}

}  // namespace
}  // namespace photocoag::testing
