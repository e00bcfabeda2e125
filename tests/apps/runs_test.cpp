// `photocoag runs`: a line for each run folder, and for one that cannot be read.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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

}  // namespace
}  // namespace photocoag::testing
