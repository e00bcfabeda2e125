// `export-c`: what it writes, what it says of the supervisor, what it refuses.
#include <gtest/gtest.h>

#include <filesystem>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

const std::string kSmall = " --set grid.min_cells=2000 --no-cache";

TEST(ExportC, WritesTheControllerAndSaysThatTheSupervisorIsNotInIt) {
  const Sandbox sandbox;
  const auto [exit_code, output, error] =
      sandbox.run("export-c --float --prefix eye_ --out c --set control.horizon=3" + kSmall);
  EXPECT_EQ(exit_code, 0) << error;
  EXPECT_NE((output + error).find("the supervisor is not in it"), std::string::npos);
  for (const char* name :
       {"eye_controller.c", "eye_controller.h", "eye_filter.c", "eye_qp.c", "eye_kkt.c",
        "eye_model.h", "example.c", "CMakeLists.txt", "README.md", "config.toml"}) {
    EXPECT_TRUE(std::filesystem::exists(sandbox.path("c") / name)) << name;
  }
  const std::string model = read_all(sandbox.path("c") / "eye_model.h");
  EXPECT_NE(model.find("#define EYE_HORIZON 3 "), std::string::npos);
  EXPECT_NE(model.find("typedef float eye_real;"), std::string::npos);
  EXPECT_EQ(sandbox.run("export-c --out c" + kSmall).exit_code, 2) << "the folder is not empty";
}

TEST(ExportC, RefusesByKeyBeforeItComputes) {
  const Sandbox sandbox;
  const std::pair<std::string, std::string> refused[] = {
      {"--set estimator.kind=mhe", "estimator.kind"},
      {"--set control.solver=osqp-condensed", "control.solver"},
      {"--set photoacoustics.sampling=pulses", "photoacoustics.sampling"},
      {"--config " PHOTOCOAG_SOURCE_DIR "/configs/two-unknowns.toml", "estimator.unknowns"},
      {"--prefix 1", "--prefix"},
  };
  for (const auto& [options, key] : refused) {
    const auto [exit_code, output, error] = sandbox.run("export-c --out c " + options);
    EXPECT_EQ(exit_code, 2) << options;
    EXPECT_NE(error.find(key), std::string::npos) << error;
    EXPECT_FALSE(std::filesystem::exists(sandbox.path("c"))) << options;
  }
}

}  // namespace
}  // namespace photocoag::testing
