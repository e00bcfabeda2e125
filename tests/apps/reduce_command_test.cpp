// `reduce` with its methods and `reduce --compare`, as a user runs them.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/program.hpp"

namespace photocoag {
namespace {

using testing::Sandbox;

constexpr const char* kSmall = " --set grid.min_cells=1000 --set control.period_ms=4";

TEST(ReduceCommand, EveryMethodWritesAModelWithItsCertificate) {
  const Sandbox sandbox;
  for (const std::string method :
       {"pod-deim", "balanced", "balanced-two-sided", "irka", "taylor"}) {
    const std::string file = method + ".json";
    const auto result =
        sandbox.run("reduce --order 8 --method " + method + " --out " + file + kSmall);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("proved"), std::string::npos);
    const auto json = nlohmann::json::parse(testing::read_all(sandbox.path(file)));
    EXPECT_EQ(json["method"], method);
    EXPECT_EQ(json["theta"]["kind"], method == "taylor" ? "taylor" : "deim");
    EXPECT_GT(json["certificate"]["peak"]["bound_relative_max"], 0.0);
    const auto used = sandbox.run("response --model reduced --rom " + file +
                                  " --power 0.1 --times 0.004 --csv -" + kSmall);
    EXPECT_EQ(used.exit_code, 0) << used.err;
  }
}

TEST(ReduceCommand, AModelOverTheQuantitiesOfAPriorTreatsAsTheCachedOne) {
  const Sandbox sandbox;
  const std::string eye =
      " --config " + (std::string(PHOTOCOAG_SOURCE_DIR) + "/configs/uncertain-eye.toml") + kSmall;
  const auto result = sandbox.run("reduce --out eye.json" + eye);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("uncertain 7 quantities"), std::string::npos) << result.err;
  ASSERT_EQ(sandbox.run("simulate --out made" + eye).exit_code, 0);
  const auto with_file = sandbox.run("simulate --out read --set model.file=eye.json" + eye);
  ASSERT_EQ(with_file.exit_code, 0) << with_file.err;
  EXPECT_EQ(testing::read_all(sandbox.path("read/run.csv")),
            testing::read_all(sandbox.path("made/run.csv")));
  const auto without = sandbox.run(std::string("reduce --out plain.json") + kSmall);
  ASSERT_EQ(without.exit_code, 0) << without.err;
  EXPECT_EQ(sandbox.run("simulate --out no --set model.file=plain.json" + eye).exit_code, 2);
}

TEST(ReduceCommand, LayeredTissueHasACertificateAndTrBdf2SaysWhyNot) {
  const Sandbox sandbox;
  const std::string layered = std::string("reduce --out model.json --set tissue.layers.sclera") +
                              ".conductivity_W_per_mK=0.4" + kSmall;
  const auto result = sandbox.run(layered);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("proved    cold start"), std::string::npos) << result.err;
  const auto json = nlohmann::json::parse(testing::read_all(sandbox.path("model.json")));
  EXPECT_LT(json["certificate"]["peak"]["treatment_bound_relative_max"], 0.03);
  EXPECT_LT(json["error"]["peak_relative_max"], 0.02);
  const auto unproved = sandbox.run(layered + " --set model.discretization=tr-bdf2");
  ASSERT_EQ(unproved.exit_code, 0) << unproved.err;
  EXPECT_NE(unproved.err.find("no bound  proved only for zero-order hold"), std::string::npos)
      << unproved.err;
}

TEST(ReduceCommand, ComparesAllMethods) {
  const Sandbox sandbox;
  const auto result = sandbox.run(std::string("reduce --compare --out errors.csv") + kSmall);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* word : {"pod-deim", "irka", "chebyshev", "superior to the Taylor series"}) {
    EXPECT_NE(result.out.find(word), std::string::npos) << word;
  }
  const std::string csv = testing::read_all(sandbox.path("errors.csv"));
  // A head, 5 methods at 13 orders, 4 dependences at 7 numbers of terms.
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 6 * 13 + 4 * 7);
}

TEST(ReduceCommand, NeedsAPlaceForTheModelOnly) {
  const Sandbox sandbox;
  const auto result = sandbox.run(std::string("reduce") + kSmall);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("--out"), std::string::npos);
  EXPECT_EQ(sandbox.entries(), 0U);
}

}  // namespace
}  // namespace photocoag
