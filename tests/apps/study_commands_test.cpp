// Commands for many runs at once, as a user calls them.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

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
  for (const std::string command : {"reproduce", "sweep", "compare", "campaign"}) {
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
                .run(common + "--set control.horizon=3 --set "
                              "tissue.layers.RPE.thickness_um=5 --out b")
                .exit_code,
            0);
  ASSERT_EQ(sandbox.run("compare a b --out both").exit_code, 0);
  const std::string page = read_all(sandbox.path("both/index.html"));
  EXPECT_NE(page.find("control.horizon"), std::string::npos);
  EXPECT_NE(page.find("tissue.layers.RPE.thickness_um"), std::string::npos);
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
  EXPECT_EQ(read_all(sandbox.path("result/campaign.h5")), table);
  ASSERT_EQ(sandbox.run("campaign spots.toml --replay 3 --out spot").exit_code, 0);
  EXPECT_TRUE(fs::exists(sandbox.path("spot/report.html")));
  EXPECT_EQ(sandbox.run("campaign spots.toml --replay 8 --out none").exit_code, 2);
  write_all(sandbox.path("spots.toml"), campaign_text(9));
  EXPECT_EQ(sandbox.run("campaign spots.toml --out result").exit_code, 2);
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
