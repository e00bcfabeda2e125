// The program where it is not at home: little stack, no place for a cache.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

const std::string kCoarse = " --set grid.min_cells=2000 --set run.duration_ms=20";

TEST(Environment, LittleStackIsEnoughForEveryCommand) {
  const Sandbox sandbox;
  write_all(sandbox.path("spots.toml"),
            "spots = 2\nset = [\"run.duration_ms=20\", \"grid.min_cells=4000\"]\n[[input]]\n"
            "key = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.4\nhigh = 1.4\n"
            "[[input]]\nkey = \"plant.tissue.spot_radius_um\"\ndistribution = \"normal\"\n"
            "mean = 100\nsigma = 5\nlow = 85\nhigh = 115\n");
  for (const std::string& command : std::vector<std::string>{
           "simulate --out longest --set control.horizon=50" + kCoarse,
           "simulate --out moving --set estimator.kind=mhe" + kCoarse,
           "simulate --out proven --set control.robust=certified --set control.period_ms=4 "
           "--set run.duration_ms=40 --set grid.min_cells=2000",
           "treat --out treated" + kCoarse, "reduce --out model.json --set grid.min_cells=2000",
           "campaign spots.toml --out spots", "replay longest", "faults --row M1"}) {
    const ProgramResult run = sandbox.run(command, "prlimit --stack=131072:131072");
    EXPECT_LE(run.exit_code, command.starts_with("treat") ? 1 : 0) << command << "\n" << run.err;
  }
}

TEST(Environment, WithoutAPlaceForTheCacheTheModelIsMadeAnew) {
  const Sandbox sandbox;
  const std::string command = "simulate" + kCoarse + " --out ";
  ASSERT_EQ(sandbox.run(command + "usual").exit_code, 0);
  const std::string expected = read_all(sandbox.path("usual/run.csv"));
  int number = 0;
  for (const std::string place :
       {"env -u XDG_CACHE_HOME -u HOME", "env XDG_CACHE_HOME=/proc/nobody",
        "env -u XDG_CACHE_HOME HOME=/nonexistent", "env XDG_CACHE_HOME=/dev/null HOME=/dev/null"}) {
    const std::string out = "run" + std::to_string(++number);
    const ProgramResult run = sandbox.run(command + out, place);
    EXPECT_EQ(run.exit_code, 0) << place << run.err;
    EXPECT_EQ(read_all(sandbox.path(out + "/run.csv")), expected) << place;
  }
}

}  // namespace
}  // namespace photocoag::testing
