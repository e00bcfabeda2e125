// The files in configs/ and the configuration printed in the documentation.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "photocoag/config/config.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = PHOTOCOAG_SOURCE_DIR;

std::string content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

Config shipped(std::string_view name) {
  return load_config((kSource / "configs" / name).string(), {});
}

TEST(Shipped, EveryFileLoads) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kSource / "configs")) {
    if (entry.path().extension() != ".toml") continue;
    EXPECT_NO_THROW(load_config(entry.path().string(), {})) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST(Shipped, PaperAt1kHz) {
  const Config config = shipped("paper-1khz.toml");
  EXPECT_EQ(config.control.period, 1e-3);
  EXPECT_EQ(config.control.horizon, 2);
  EXPECT_EQ(config.control.state_weight, StateWeight::kConstant);
  EXPECT_EQ(config.control.power_weight, 0.0);
  EXPECT_EQ(config.control.power_change_weight, 0.0);
  EXPECT_EQ(config.cycles(), 250U);
}

TEST(Shipped, PaperAt250Hz) {
  struct Case {
    const char* file;
    StateWeight state_weight;
    double power_weight;
    double power_change_weight;
  };
  for (const Case& c : {Case{"paper-250hz-a.toml", StateWeight::kConstant, 5e4, 0.0},
                        Case{"paper-250hz-b.toml", StateWeight::kDelayed, 5e1, 0.0},
                        Case{"paper-250hz-c.toml", StateWeight::kConstant, 0.0, 5e4},
                        Case{"paper-250hz-d.toml", StateWeight::kDelayed, 0.0, 5e1}}) {
    Config expected;
    expected.control.period = 4e-3;
    expected.control.horizon = 5;
    expected.control.state_weight = c.state_weight;
    expected.control.power_weight = c.power_weight;
    expected.control.power_change_weight = c.power_change_weight;
    expected.run.duration = 0.4;
    expected.safety.supervised = false;  // the paper has no supervisor
    EXPECT_EQ(shipped(c.file), expected) << c.file;
  }
}

TEST(Shipped, OtherTissues) {
  Config vitreous = shipped("paper-1khz.toml");
  vitreous.tissue.layers[4].thickness = 2000e-6;
  vitreous.tissue.layers.insert(vitreous.tissue.layers.begin(), Layer{"vitreous", 2000e-6});
  vitreous.plant.tissue = vitreous.tissue;
  EXPECT_EQ(shipped("paper-vitreous.toml"), vitreous);

  Config choroid = shipped("paper-1khz.toml");
  choroid.tissue.layers[3].absorption = 26622.0;
  choroid.plant.tissue = choroid.tissue;
  EXPECT_EQ(shipped("literature-choroid.toml"), choroid);

  Config two = shipped("paper-1khz.toml");
  two.estimator.unknowns = Unknowns::kRpeAndChoroid;
  two.tissue.layers[3].scaled_by = ScaledBy::kBeta;
  two.plant.tissue = two.tissue;
  two.plant.choroid_factor = 1.4;
  EXPECT_EQ(shipped("two-unknowns.toml"), two);

  Config in_vivo = vitreous;
  in_vivo.control.peak_reference = 10.0;
  in_vivo.control.peak_max = 12.0;
  in_vivo.control.power_max = 0.05;
  in_vivo.tissue.ambient_celsius = 37.0;
  in_vivo.tissue.layers[4].absorption = 26622.0;
  in_vivo.tissue.layers[4].perfusion = 2e5;
  in_vivo.plant.tissue = in_vivo.tissue;
  EXPECT_EQ(shipped("in-vivo.toml"), in_vivo);
  EXPECT_TRUE(in_vivo.tissue.uniform_conduction()) << "it runs on the fast path";
}

TEST(Shipped, DocumentationShowsTheDefaults) {
  const std::string document = content(kSource / "docs" / "configuration.md");
  EXPECT_NE(document.find("```toml\n" + to_toml(Config{}) + "```\n"), std::string::npos)
      << "put the output of `photocoag config` into docs/configuration.md";
}

}  // namespace
}  // namespace photocoag
