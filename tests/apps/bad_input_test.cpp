// Bad input: exit code 2, a message that names place, key, value and what is accepted, and nothing
// written.
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

using Words = std::vector<std::string>;

struct BadInput {
  std::string arguments;
  Words must_say;
};

void PrintTo(const BadInput& input, std::ostream* out) { *out << input.arguments; }

class BadInputTest : public ::testing::TestWithParam<BadInput> {};

TEST_P(BadInputTest, ExitsWithTwoSaysWhyAndWritesNothing) {
  const Sandbox sandbox;
  write_all(sandbox.path("typo.toml"), "[control]\nhorizn = 5\n");
  write_all(sandbox.path("wrong.toml"), "[control]\nhorizon = \"five\"\n");
  write_all(sandbox.path("nan.toml"), "[control]\n\npeak_max_K = nan\n");
  write_all(sandbox.path("garbage.json"), "{\"format\": \"photocoag reduced model\", ");
  const std::size_t before = sandbox.entries();
  for (const std::string command : {"simulate", "treat"}) {
    const ProgramResult result = sandbox.run(command + " --out run " + GetParam().arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    for (const std::string& word : GetParam().must_say) {
      EXPECT_NE(result.err.find(word), std::string::npos) << "missing: " << word << "\n"
                                                          << result.err;
    }
    EXPECT_EQ(sandbox.entries(), before) << "something was written";
    EXPECT_TRUE(result.out.empty()) << result.out;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadInputTest,
    ::testing::Values(
        BadInput{"--config typo.toml", {"typo.toml:2", "control.horizn", "control.horizon"}},
        BadInput{"--config wrong.toml", {"wrong.toml:2", "control.horizon", "five", "integer"}},
        BadInput{"--config nan.toml", {"nan.toml:3", "control.peak_max_K", "nan", "150"}},
        BadInput{"--config missing.toml", {"missing.toml", "No such file", "TOML"}},
        BadInput{"--set control.power_max_W=100", {"control.power_max_W", "100", "at most 1"}},
        BadInput{"--set control.peak_reference_K=33",
                 {"control.peak_reference_K", "33", "below the limit", "32"}},
        BadInput{"--set control.horizon=0", {"control.horizon", "0", "2 to 50"}},
        BadInput{"--set control.horizon=1000", {"control.horizon", "1000", "2 to 50"}},
        BadInput{"--set control.horizon=5.5", {"control.horizon", "5.5", "integer"}},
        BadInput{"--set control.state_weight=delayed", {"control.state_weight", "power_weight"}},
        BadInput{"--set plant.absorption_factor=inf", {"plant.absorption_factor", "inf"}},
        BadInput{"--set run.duration_ms=-1", {"run.duration_ms", "-1"}},
        BadInput{"--set control.power_max_mW=100", {"control.power_max_mW", "control.power_max_W"}},
        BadInput{"--set tissue.layers.RPF.thickness_um=5", {"RPF", "RPE"}},
        BadInput{"--seed -3", {"run.seed", "-3"}},
        BadInput{"--set model.file=absent.json", {"absent.json", "model.file", "No such file"}},
        BadInput{"--set model.file=garbage.json", {"garbage.json", "JSON"}},
        BadInput{"--nonsense", {"--nonsense"}}));

TEST(BadInput, ACommandThatIsNoneIsNamed) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run("simulat --set run.seed=2");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err, "photocoag: there is no command simulat; photocoag --help lists all\n");
}

TEST(BadModelFile, TruncatedAlteredOrForAnotherPeriodIsRefused) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("reduce --set grid.min_cells=2000 --out good.json").exit_code, 0);
  const std::string good = read_all(sandbox.path("good.json"));
  write_all(sandbox.path("short.json"), good.substr(0, good.size() / 2));
  std::string altered = good;
  const std::size_t digit = altered.find_first_of("123456789", altered.find("\"C_peak\""));
  altered[digit] = altered[digit] == '9' ? '8' : static_cast<char>(altered[digit] + 1);
  write_all(sandbox.path("altered.json"), altered);
  const std::size_t before = sandbox.entries();

  const auto refused = [&](const std::string& arguments, const Words& must_say) {
    const ProgramResult result = sandbox.run("simulate --out run " + arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    for (const std::string& word : must_say) {
      EXPECT_NE(result.err.find(word), std::string::npos) << "missing: " << word << "\n"
                                                          << result.err;
    }
    EXPECT_EQ(sandbox.entries(), before);
  };
  refused("--set model.file=short.json", {"short.json", "not a complete model file"});
  refused("--set model.file=altered.json", {"altered.json", "checksum", "altered"});
  refused("--set model.file=good.json --set control.period_ms=4",
          {"good.json", "control.period_ms", "4 ms, model for 1 ms"});
  refused("--set model.file=good.json --set model.discretization=implicit-euler",
          {"good.json", "model.discretization", "zero-order-hold"});
  refused("--set model.file=good.json --set tissue.spot_radius_um=90",
          {"good.json", "spot_radius", "[plant.tissue]"});
  const ProgramResult accepted = sandbox.run("simulate --out run --set model.file=good.json");
  EXPECT_EQ(accepted.exit_code, 0) << accepted.err;
}

TEST(BadUsage, OutFolderWithContentIsRefusedAndUntouched) {
  const Sandbox sandbox;
  std::filesystem::create_directory(sandbox.path("run"));
  write_all(sandbox.path("run") / "mine.txt", "precious");
  const ProgramResult result = sandbox.run("simulate --out run");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("not an empty folder"), std::string::npos) << result.err;
  EXPECT_EQ(read_all(sandbox.path("run") / "mine.txt"), "precious");
}

TEST(BadUsage, ACoreThatIsNotThereIsRefused) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run("treat --out run --set safety.core=1023");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("safety.core"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("1023"), std::string::npos) << result.err;
  EXPECT_EQ(sandbox.entries(), 0u);
}

TEST(BadUsage, ResponseRefusesBadTimesAndModels) {
  const Sandbox sandbox;
  const Words bad = {
      "response --model full --power 1 --times 0.001,nan",
      "response --model full --power 1 --times -0.001",
      "response --model full --power -1 --times 0.001",
      "response --model half --power 1 --times 0.001",
      "response --model full --power 1",
      "response --model full --rom x.json --power 1 --times 0.001",
      "response --model reduced --rom absent.json --power 1 --times 0.001",
      "response --model full --power 1 --times 0.0015 --set plant.discretization=implicit-euler",
  };
  for (const std::string& arguments : bad) {
    const ProgramResult result = sandbox.run(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << "\n" << result.err;
    EXPECT_FALSE(result.err.empty()) << arguments;
    EXPECT_TRUE(result.out.empty()) << arguments;
  }
}

}  // namespace
}  // namespace photocoag::testing
