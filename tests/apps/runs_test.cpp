// `photocoag runs`: a line for each run folder, and for one that cannot be read.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;

TEST(Runs, EachFolderHasItsVerdict) {
  const Sandbox sandbox;
  const std::string coarse = " --set grid.min_cells=2000 --set run.duration_ms=100 --seed 7";
  ASSERT_EQ(sandbox.run("simulate --out runs/a" + coarse).exit_code, 0);
  ASSERT_EQ(sandbox.run("simulate --out runs/b --set plant.sample_gain=0.5" + coarse).exit_code, 1);
  ASSERT_EQ(sandbox.run("simulate --out runs/c" + coarse).exit_code, 0);
  write_all(sandbox.path("runs/c/run.csv"), "cycle\nx\n");
  const Json all = Json::parse(sandbox.run("runs --json").out);
  const Json& runs = all["runs"];
  ASSERT_EQ(runs.size(), 3U);
  EXPECT_EQ(runs[0]["folder"], "runs/a");
  EXPECT_EQ(runs[0]["verdict"], "Held");
  EXPECT_EQ(runs[0]["seed"], "7");
  EXPECT_EQ(runs[1]["verdict"], "Stopped");
  EXPECT_EQ(runs[2]["verdict"], "Unreadable");
  const std::string text = sandbox.run("runs").out;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
  EXPECT_NE(text.find("runs/a  Held 30 K: "), std::string::npos) << text;
  EXPECT_EQ(Json::parse(sandbox.run("runs runs/a --json").out)["runs"].size(), 1U);
  EXPECT_EQ(sandbox.run("runs nowhere").exit_code, 2);
}

// One run folder copied: names, seeds and configurations are each folder's own.
TEST(Runs, LinesAreInTheOrderOfNamesAndSayWhatIsInTheirFolder) {
  namespace fs = std::filesystem;
  const Sandbox sandbox;
  const std::string short_run = "simulate --set grid.min_cells=2000 --set run.duration_ms=10 ";
  ASSERT_EQ(sandbox.run(short_run + "--seed 7 --out runs/e").exit_code, 0);
  ASSERT_EQ(sandbox.run(short_run + "--seed 8 --set plant.noise_K=0.1 --out runs/cc").exit_code, 0);
  for (const std::string name : {"runs/g", "runs/d/x", "runs/bbbbb", "runs/a", "runs/e/inside"}) {
    fs::create_directories(sandbox.path(name).parent_path());
    fs::copy(sandbox.path("runs/cc"), sandbox.path(name));
  }
  fs::remove(sandbox.path("runs/g/run.csv"));
  for (const std::string file : {"campaign.toml", "session.json"}) {
    fs::copy(sandbox.path("runs/cc"), sandbox.path("runs/with_" + file));
    write_all(sandbox.path("runs/with_" + file + "/" + file), "");
  }
  fs::create_directory(sandbox.path("runs/still_running"));
  fs::copy(sandbox.path("runs/e/config.toml"), sandbox.path("runs/still_running/config.toml"));

  const ProgramResult told = sandbox.run("runs --json");
  EXPECT_EQ(told.exit_code, 0);
  const Json all = Json::parse(told.out);
  EXPECT_EQ(all["folder"], "runs");
  std::vector<std::string> names;
  for (const Json& run : all["runs"]) {
    names.push_back(run["folder"]);
    if (run["verdict"] == "Unreadable") continue;
    const Json summary = Json::parse(read_all(sandbox.path(names.back() + "/summary.json")));
    EXPECT_EQ(run["seed"], summary["seed"].dump()) << names.back();
    EXPECT_EQ(run["config_sha256"], summary["config_sha256"]) << names.back();
  }
  const std::vector<std::string> ordered = {"runs/a", "runs/bbbbb", "runs/cc", "runs/e", "runs/g"};
  EXPECT_EQ(names, ordered);
  EXPECT_NE(all["runs"][2]["seed"], all["runs"][3]["seed"]);
  const std::string why = all["runs"][4]["said"];
  EXPECT_NE(why.find("runs/g/run.csv"), std::string::npos) << why;

  // One column of names, one of what came of each.
  const ProgramResult shown = sandbox.run("runs");
  EXPECT_EQ(shown.exit_code, 0);
  std::istringstream lines(shown.out);
  std::size_t k = 0;
  for (std::string line; std::getline(lines, line); ++k) {
    ASSERT_LT(k, ordered.size());
    EXPECT_EQ(line.substr(0, 12), ordered[k] + std::string(12 - ordered[k].size(), ' '));
    EXPECT_EQ(line.substr(12), all["runs"][k]["said"].get<std::string>());
  }
  EXPECT_EQ(k, ordered.size());

  const Json below = Json::parse(sandbox.run("runs runs/e --json").out)["runs"];
  ASSERT_EQ(below.size(), 2U) << "the folder itself, and one in it";
  EXPECT_EQ(below[1]["folder"], "runs/e/inside");
}

}  // namespace
}  // namespace photocoag::testing
