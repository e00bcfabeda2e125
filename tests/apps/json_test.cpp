// --json: one object on standard output and nothing else, whatever the command came to.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "session/sessions.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;
const std::string kCoarse = " --set grid.min_cells=2000 --set run.duration_ms=20";

/// All of standard output as one object; it says what the program has returned.
Json object_of(const ProgramResult& result) {
  const Json json = Json::parse(result.out, nullptr, false);
  EXPECT_TRUE(json.is_object()) << result.out << result.err;
  if (!json.is_object()) return Json::object();
  EXPECT_EQ(json["exit_code"], result.exit_code);
  return json;
}

TEST(JsonOutput, OfARunIsItsSummary) {
  const Sandbox sandbox;
  for (const std::string command : {"treat", "simulate"}) {
    const Json json = object_of(sandbox.run(command + kCoarse + " --json --out " + command));
    EXPECT_EQ(json["command"], command);
    EXPECT_EQ(json["folder"], command);
    EXPECT_EQ(json["summary"], Json::parse(read_all(sandbox.path(command + "/summary.json"))));
  }
}

TEST(JsonOutput, ASupervisorsStopIsInIt) {
  const Sandbox sandbox;
  const Json json =
      object_of(sandbox.run("simulate --set plant.sample_gain=0.5 --set grid.min_cells=2000 "
                            "--json --out run"));
  EXPECT_EQ(json["exit_code"], 1);
  EXPECT_TRUE(json["summary"]["stopped_for"].is_string());
}

TEST(JsonOutput, OfAReductionIsItsErrors) {
  const Sandbox sandbox;
  const std::string reduce = "reduce --set grid.min_cells=2000 --json --out ";
  const Json json = object_of(sandbox.run(reduce + "model.json"));
  const Json model = Json::parse(read_all(sandbox.path("model.json")));
  EXPECT_EQ(json["order"], 6);
  EXPECT_EQ(json["file"], "model.json");
  EXPECT_EQ(json["errors"].size(), 29U);
  double largest = 0.0;
  for (const Json& row : json["errors"]) {
    largest = std::max(largest, row["peak_relative"].get<double>());
  }
  EXPECT_EQ(json["peak_error_relative_max"], largest);
  EXPECT_GT(json["proved"]["peak"]["relative"], largest);
  EXPECT_EQ(sandbox.run(reduce + "-").exit_code, 2) << "standard output holds one thing";
  EXPECT_EQ(sandbox.run(reduce + "x --compare").exit_code, 2);
}

TEST(JsonOutput, OfCampaignAndSessionIsTheirSummary) {
  const Sandbox sandbox;
  write_all(sandbox.path("c.toml"),
            "spots = 3\nset = [\"grid.min_cells=2000\", \"run.duration_ms=20\"]\n[[input]]\nkey = "
            "\"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.6\nhigh = 1.2\n");
  const Json campaign = object_of(sandbox.run("campaign c.toml --json --out c"));
  EXPECT_EQ(campaign["summary"], Json::parse(read_all(sandbox.path("c/summary.json"))));
  const Json spot = object_of(sandbox.run("campaign c.toml --json --replay 2 --out spot"));
  EXPECT_EQ(spot["spot"], 2);
  EXPECT_GT(spot["inputs"]["plant.absorption_factor"], 0.6);
  EXPECT_GT(spot["outcomes"]["peak_max_K"], 1.0);
  write_all(sandbox.path("s.toml"), small_session("", "[limits]\nspots = 1\n"));
  const Json session = object_of(sandbox.run("session s.toml --json --out s"));
  EXPECT_EQ(session["exit_code"], 1);
  EXPECT_EQ(session["summary"], Json::parse(read_all(sandbox.path("s/summary.json"))));
}

TEST(JsonOutput, BadInputLeavesStandardOutputEmpty) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run("simulate --json --set control.horizon=1000");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
}

}  // namespace
}  // namespace photocoag::testing
