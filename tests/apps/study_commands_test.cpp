// Commands for many runs at once, as a user calls them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kStudies = PHOTOCOAG_SOURCE_DIR "/studies";

// Small and fast: these tests are about the program, not the physics.
std::string campaign_text(int spots) {
  return "spots = " + std::to_string(spots) +
         "\nset = [\"run.duration_ms=20\", \"grid.min_cells=4000\"]\n"
         "[[input]]\nkey = \"plant.absorption_factor\"\ndistribution = \"uniform\"\n"
         "low = 0.4\nhigh = 1.4\n"
         "[[input]]\nkey = \"plant.tissue.spot_radius_um\"\ndistribution = \"normal\"\n"
         "mean = 100\nsigma = 5\nlow = 85\nhigh = 115\n";
}

TEST(StudyCommands, HelpTeaches) {
  const Sandbox sandbox;
  for (const std::string command : {"reproduce", "explain", "sweep", "compare", "campaign"}) {
    const ProgramResult help = sandbox.run(command + " --help");
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_NE(help.out.find("Examples:"), std::string::npos) << command;
    EXPECT_NE(help.out.find("not a medical device"), std::string::npos) << command;
  }
}

// Two short studies: the shipped ones are run by continuous integration in full width.
TEST(StudyCommands, ReproduceWritesPageFiguresAndVerdicts) {
  const Sandbox sandbox;
  fs::create_directories(sandbox.path("studies"));
  fs::copy(kStudies + "/four-spots-1khz.toml", sandbox.path("studies"));
  fs::copy(kStudies + "/computation-times.toml", sandbox.path("studies"));
  write_all(sandbox.path("studies/plan.toml"),
            "studies = [\"four-spots-1khz\", \"computation-times\"]\nseeds = 2\n");
  // Exit code 1 (a verdict that changed) is possible with two seeds; 2 would be a failure.
  const ProgramResult run = sandbox.run("reproduce --quick --studies studies --out paper");
  ASSERT_LE(run.exit_code, 1) << run.err;
  for (const std::string file : {"index.html", "claims.json", "four-spots-1khz-spots.svg",
                                 "four-spots-1khz-spots.csv", "computation-times.svg"}) {
    EXPECT_TRUE(fs::exists(sandbox.path("paper/" + file))) << file;
  }
  const Json claims = Json::parse(read_all(sandbox.path("paper/claims.json")))["claims"];
  EXPECT_EQ(claims.size(), 9U);
  for (const Json& claim : claims) {
    EXPECT_EQ(claim["measured"].empty(), claim["verdict"] == "cannot be judged here") << claim;
    EXPECT_EQ(claim["seeds"], 2) << claim;
  }
  const std::string page = read_all(sandbox.path("paper/index.html"));
  EXPECT_EQ(page.find("<script", page.find("<script") + 1), std::string::npos);  // its own alone
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(sandbox.run("reproduce --quick --studies studies --out paper").exit_code, 2);
  // More seeds: of the closed loops; the solver's times stay the plan's.
  ASSERT_LE(sandbox.run("reproduce --quick --seeds 3 --studies studies --out more").exit_code, 1);
  for (const Json& claim : Json::parse(read_all(sandbox.path("more/claims.json")))["claims"]) {
    EXPECT_EQ(claim["seeds"], claim["study"] == "computation-times" ? 2 : 3) << claim;
  }
  write_all(sandbox.path("studies/plan.toml"), "studies = [\"nothing\"]\n");
  EXPECT_EQ(sandbox.run("reproduce --studies studies --out other").exit_code, 2);
}

// A small search: two things that may be, two statements.
TEST(StudyCommands, ExplainSearchesConfirmsAndWritesAPage) {
  const Sandbox sandbox;
  write_all(sandbox.path("search.toml"), R"(title = "Small"
set = ["plant.model=reduced", "control.period_ms=4", "run.duration_ms=80", "grid.min_cells=2000"]
seeds = 2
confirm_seeds = 3
best_sets = 1
lag_run = "r1"
hot_run = "r1"
scan_factor = "alpha"
lags = [0.0, 0.5]
run = [{id = "r1", set = ["control.power_weight=5e4"]}]
statement = [
  {text = "absorbs much", holds_if = "median(power_max_mW, r1) < 60"},
  {text = "keeps the limit", holds_if = "max(estimate_over_limit_K, r1) <= 0", in_truth = "max(over_limit_K, r1) <= 0"},
]
candidate = [{label = "late", set = ["plant.sample_lag_periods=0.5"]}]
remedy = [{label = "told", set = ["control.power_weight=5e4"], told = "found"}]
[[factor]]
id = "alpha"
title = "alpha"
level = [{label = "0.5", set = ["plant.absorption_factor=0.5"]}, {label = "1.1", set = ["plant.absorption_factor=1.1"]}]
[[factor]]
id = "noise"
title = "noise"
change = "alone"
level = [{label = "0.288 K"}, {label = "0.1 K", set = ["plant.noise_K=0.1"]}]
[[scan]]
title = "lag"
key = "plant.sample_lag_periods"
values = [0.0, 0.5]
)");
  const ProgramResult run = sandbox.run("explain search.toml --out found");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("100 %  100 %  keeps the limit"), std::string::npos) << run.out;
  const Json json = Json::parse(read_all(sandbox.path("found/explanation.json")));
  EXPECT_EQ(json["sets_searched"], 2);
  ASSERT_EQ(json["confirmed"].size(), 2U);
  EXPECT_EQ(json["confirmed"][1]["set"], "late");
  EXPECT_EQ(json["confirmed"][1]["true_lag_periods"], 0.5);
  EXPECT_EQ(json["confirmed"][0]["found_lags_periods"].size(), 3U);
  EXPECT_EQ(json["remedies"].size(), 1U);
  for (const std::string file : {"index.html", "sets.csv", "sensitivity-1.svg"}) {
    EXPECT_TRUE(fs::exists(sandbox.path("found/" + file))) << file;
  }
  EXPECT_EQ(read_all(sandbox.path("found/index.html")).find("src="), std::string::npos);
  // Not empty any more; not there.
  EXPECT_EQ(sandbox.run("explain search.toml --out found").exit_code, 2);
  const ProgramResult none = sandbox.run("explain nothing.toml --out other");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_FALSE(fs::exists(sandbox.path("other")));
}

// A claim that expects another verdict than the data give: exit code 1, and the page says so.
TEST(StudyCommands, AChangedVerdictIsExitCode1) {
  const Sandbox sandbox;
  fs::create_directories(sandbox.path("studies"));
  write_all(sandbox.path("studies/plan.toml"), "studies = [\"one\"]\nseeds = 1\n");
  write_all(sandbox.path("studies/one.toml"),
            "title = \"One\"\npaper = \"none\"\nset = [\"run.duration_ms=10\", "
            "\"plant.model=reduced\"]\n[[column]]\nid = \"c\"\ntitle = \"c\"\n[[run]]\nid = \"r\"\n"
            "column = \"c\"\n[[claim]]\ntext = \"Ice.\"\nholds_if = \"max(peak_max_K, r) < 1\"\n"
            "expected = \"holds\"\n");
  const ProgramResult run = sandbox.run("reproduce --studies studies --out paper");
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE(run.out.find("CHANGED"), std::string::npos);
  EXPECT_NE(read_all(sandbox.path("paper/index.html")).find("VERDICTS HAVE CHANGED"),
            std::string::npos);
}

TEST(StudyCommands, SweepAndCompareWriteTheirPages) {
  const Sandbox sandbox;
  const ProgramResult run = sandbox.run(
      "sweep --set run.duration_ms=10 --set plant.model=reduced --vary control.horizon=2,5 "
      "--vary control.power_weight=0,5e4 --out sweep");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string csv = read_all(sandbox.path("sweep/sweep.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
  EXPECT_TRUE(fs::exists(sandbox.path("sweep/sweep.svg")));
  EXPECT_EQ(sandbox.run("sweep --vary control.horizn=2,5 --out other").exit_code, 2);

  const std::string common = "simulate --set grid.min_cells=2000 --set run.duration_ms=10 ";
  ASSERT_EQ(sandbox.run(common + "--out a").exit_code, 0);
  ASSERT_EQ(sandbox
                .run(common +
                     "--set control.horizon=3 --set tissue.layers.RPE.thickness_um=5 --set "
                     "'prior=[{key=\"plant.noise_K\", distribution=\"uniform\", low=0.1, "
                     "high=0.5}, {key=\"calibration_factor\", distribution=\"uniform\", low=0.9, "
                     "high=1.1}]' --out b")
                .exit_code,
            0);
  ASSERT_EQ(sandbox.run("compare a b --out both").exit_code, 0);
  const std::string page = read_all(sandbox.path("both/index.html"));
  EXPECT_NE(page.find("control.horizon"), std::string::npos);
  EXPECT_NE(page.find("tissue.layers.RPE.thickness_um"), std::string::npos);
  EXPECT_NE(page.find("prior.plant.noise_K.low"), std::string::npos);
  EXPECT_NE(page.find("prior.calibration_factor.high"), std::string::npos);
  EXPECT_EQ(page.find("control.peak_max_K</th>"), std::string::npos);  // is the same in both
  EXPECT_EQ(sandbox.run("compare a nothing --out other").exit_code, 2);
}

TEST(StudyCommands, ACampaignContinuesAndReplays) {
  const Sandbox sandbox;
  write_all(sandbox.path("spots.toml"), campaign_text(8));
  const ProgramResult run = sandbox.run("campaign spots.toml --out result");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string table = read_all(sandbox.path("result/campaign.h5"));
  const ProgramResult again = sandbox.run("campaign spots.toml --out result");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.err.find("0 computed now"), std::string::npos) << again.err;
  EXPECT_EQ(again.err.find("nan"), std::string::npos) << again.err;  // nothing after 50 ms
  EXPECT_EQ(read_all(sandbox.path("result/campaign.h5")), table);
  ASSERT_EQ(sandbox.run("campaign spots.toml --replay 3 --out spot").exit_code, 0);
  EXPECT_TRUE(fs::exists(sandbox.path("spot/report.html")));
  EXPECT_EQ(sandbox.run("campaign spots.toml --replay 8 --out none").exit_code, 2);
  const ProgramResult estimate = sandbox.run("campaign spots.toml --estimate 5");
  EXPECT_EQ(estimate.exit_code, 2);
  EXPECT_NE(estimate.err.find("estimator.kind"), std::string::npos) << estimate.err;
  EXPECT_EQ(sandbox.run("campaign spots.toml --estimate 9").exit_code, 2);
  write_all(sandbox.path("spots.toml"), campaign_text(9));
  EXPECT_EQ(sandbox.run("campaign spots.toml --out result").exit_code, 2);
}

// Starts what follows, and sends it a signal once a file has so many bytes.
const std::string kSignalAt =
    "bytes=$1 file=$2 signal=$3; shift 3; \"$@\" & p=$!\n"
    "while kill -0 $p 2>/dev/null && [ $(stat -c %s $file 2>/dev/null || echo 0) -lt $bytes ]; do\n"
    "  sleep 0.005\ndone\nkill -$signal $p\nwait $p\n";

// Calls `interrupted(spots)` with more spots until it says that the signals came in time: on a busy
// machine the program may be done with a few before the shell looks again.
template <typename F>
void with_enough_spots(F&& interrupted) {
  for (int spots = 400; spots <= 102'400; spots *= 4) {
    if (interrupted(spots)) return;
  }
  FAIL() << "never interrupted";
}

// Killed in the middle, where nothing can be tidied up, twice.
TEST(StudyCommands, AKilledCampaignContinuesToTheSameBytes) {
  with_enough_spots([](int spots) {
    const Sandbox sandbox;
    write_all(sandbox.path("spots.toml"), campaign_text(spots));
    write_all(sandbox.path("signal-at.sh"), kSignalAt);
    for (const std::string bytes : {"20000", "50000"}) {
      const ProgramResult killed = sandbox.run(
          "campaign spots.toml --out cut", "sh signal-at.sh " + bytes + " cut/journal.bin KILL");
      if (killed.exit_code == 0 || fs::exists(sandbox.path("cut/campaign.h5"))) return false;
      EXPECT_EQ(killed.exit_code, 128 + 9) << killed.err;
    }
    const ProgramResult rest = sandbox.run("campaign spots.toml --out cut");
    EXPECT_EQ(rest.exit_code, 0) << rest.err;
    EXPECT_EQ(rest.err.find(fmt::format(" {} computed now", spots)), std::string::npos) << rest.err;
    EXPECT_EQ(sandbox.run("campaign spots.toml --out whole").exit_code, 0);
    for (const std::string file : {"campaign.h5", "summary.json", "tables.md", "index.html"}) {
      EXPECT_EQ(read_all(sandbox.path("cut/" + file)), read_all(sandbox.path("whole/" + file)));
    }
    return true;
  });
}

TEST(StudyCommands, OnlyACompleteCampaignWritesItsTableIfAskedTo) {
  with_enough_spots([](int spots) {
    const Sandbox sandbox;
    write_all(sandbox.path("spots.toml"), campaign_text(spots));
    write_all(sandbox.path("signal-at.sh"), kSignalAt);
    const std::string command = "campaign spots.toml --out result --only-complete";
    const ProgramResult stopped =
        sandbox.run(command, "sh signal-at.sh 5000 result/journal.bin TERM");
    if (stopped.exit_code == 0) return false;
    EXPECT_EQ(stopped.exit_code, 1) << stopped.err;
    EXPECT_FALSE(fs::exists(sandbox.path("result/campaign.h5")));
    EXPECT_NE(stopped.err.find("STOPPED"), std::string::npos) << stopped.err;
    EXPECT_EQ(sandbox.run(command).exit_code, 0);
    EXPECT_TRUE(fs::exists(sandbox.path("result/campaign.h5")));
    return true;
  });
}

// A bench's keys in every command: drawn by a campaign, they are in the replay's configuration, and
// simulate and treat do with it what the campaign did.
TEST(StudyCommands, ACampaignDrawsABenchAndSimulateAndTreatHaveTheSame) {
  const Sandbox sandbox;
  const std::vector<std::pair<std::string, std::string>> inputs = {
      {"sample_averaging_periods", "low = 0.2\nhigh = 0.3"},
      {"sample_lag_periods", "low = 0.3\nhigh = 0.4"},
      {"power_lag_periods", "low = 0.1\nhigh = 0.2"},
      {"power_gain", "low = 0.8\nhigh = 0.9"},
      {"sample_gain", "low = 0.8\nhigh = 0.9"},
      {"absorption_drift_per_s", "low = 0.5\nhigh = 0.6"}};
  std::string text =
      "spots = 2\nset = [\"run.duration_ms=40\", \"control.period_ms=4\", "
      "\"grid.min_cells=4000\", \"plant.power_readback=none\", \"safety.supervisor=off\"]\n";
  for (const auto& [key, range] : inputs) {
    text += "[[input]]\nkey = \"plant." + key + "\"\ndistribution = \"uniform\"\n" + range + "\n";
  }
  write_all(sandbox.path("bench.toml"), text);
  ASSERT_EQ(sandbox.run("campaign bench.toml --out bench").exit_code, 0);
  ASSERT_LE(sandbox.run("campaign bench.toml --replay 1 --out spot").exit_code, 1);
  const std::string config = read_all(sandbox.path("spot/config.toml"));
  const std::string plant = config.substr(config.find("[plant]"));
  for (const auto& [key, range] : inputs) {
    const double drawn = std::stod(plant.substr(plant.find('=', plant.find("\n" + key)) + 1));
    EXPECT_GE(drawn, std::stod(range.substr(range.find('=') + 1))) << key;
    EXPECT_LE(drawn, std::stod(range.substr(range.rfind('=') + 1))) << key;
  }
  ASSERT_LE(sandbox.run("simulate --config spot/config.toml --out simulated").exit_code, 1);
  const auto peak = [&sandbox](const std::string& folder) {
    return Json::parse(read_all(sandbox.path(folder + "/summary.json")))["peak_true_max_K"]
        .get<double>();
  };
  // 0.1 K: a campaign's grid is not fitted to the spot.
  EXPECT_NEAR(peak("simulated"), peak("spot"), 0.1);
  ASSERT_EQ(sandbox
                .run("simulate --out ideal --set run.duration_ms=40 --set control.period_ms=4 "
                     "--set grid.min_cells=4000 --set safety.supervisor=off")
                .exit_code,
            0);
  EXPECT_GT(std::abs(peak("ideal") - peak("spot")), 0.5);  // the bench is in it
  ASSERT_LE(sandbox.run("treat --config spot/config.toml --out treated").exit_code, 1);
  EXPECT_EQ(read_all(sandbox.path("treated/config.toml")), config);
  text.replace(text.find("high = 0.4"), 10, "high = 1.4");
  write_all(sandbox.path("bad.toml"), text);
  const ProgramResult bad = sandbox.run("campaign bad.toml --out bad");
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.err.find("plant.sample_lag_periods: found 1.4; accepted:"), std::string::npos)
      << bad.err;
}

TEST(StudyCommands, TwoRanksGiveTheBytesOfOne) {
  const Sandbox sandbox;
  if (sandbox.run("--version", "command -v mpirun >/dev/null || exit 99;").exit_code == 99) {
    GTEST_SKIP() << "no mpirun here";
  }
  write_all(sandbox.path("spots.toml"), campaign_text(40));
  ASSERT_EQ(sandbox.run("campaign spots.toml --out one --threads 1").exit_code, 0);
  const ProgramResult two = sandbox.run(
      "campaign spots.toml --out two --threads 2",
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe -n 2");
  ASSERT_EQ(two.exit_code, 0) << two.err;
  EXPECT_NE(two.err.find("2 ranks"), std::string::npos) << two.err;
  EXPECT_EQ(read_all(sandbox.path("one/campaign.h5")), read_all(sandbox.path("two/campaign.h5")));
}

}  // namespace
}  // namespace photocoag::testing
