// --set, layers by name, [plant.tissue], model.file.
#include <gtest/gtest.h>

#include "config/temporary_folder.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

Config with(const std::vector<std::string>& overrides) { return load_config("", overrides); }

TEST(Overrides, LaterOnesWinOverEarlierOnesAndOverTheFile) {
  const TemporaryFolder folder;
  const std::string file = folder.write("c.toml", "control.period_ms = 2\nrun.seed = 5\n");
  const Config config = load_config(file, {"control.period_ms=3", "control.period_ms=4"});
  EXPECT_EQ(config.control.period, 4e-3);
  EXPECT_EQ(config.run.seed, 5U);
}

TEST(Overrides, ValuesAreTomlOrElseText) {
  EXPECT_EQ(with({"control.state_weight=\"delayed\"", "control.power_weight=5e1"}),
            with({" control.state_weight = delayed ", "control.power_weight=50"}));
  EXPECT_EQ(with({"control={period_ms = 2, horizon = 3}"}),
            with({"control.period_ms=2.0", "control.horizon=3"}));
  EXPECT_EQ(with({"control.horizon=0x0A"}).control.horizon, 10);
  EXPECT_EQ(with({"control.period_ms=0x2"}).control.period, 2e-3);
  EXPECT_EQ(with({"tissue.density_kg_per_m3=1_000.5"}).tissue.density, 1000.5);
  EXPECT_EQ(with({"model.discretization=implicit-euler"}).model.discretization,
            Discretization::kImplicitEuler);
  EXPECT_EQ(with({"plant.model=reduced"}).plant.model, PlantModel::kReduced);
  EXPECT_EQ(with({"tissue.volume_temperature=normalized"}).tissue.volume_temperature,
            VolumeTemperature::kNormalized);
  EXPECT_EQ(with({"run.seed=9223372036854775807"}).run.seed, 9223372036854775807U);
  EXPECT_EQ(with({"model.file="}).model.file, "");
}

TEST(Overrides, LayersByName) {
  const Config config =
      with({"tissue.layers.RPE.thickness_um=5", "tissue.layers.\"choroid\".absorption_per_m=2000",
            "tissue.layers.RPE.scaled_by=none", "tissue.layers.choroid.scaled_by=alpha"});
  EXPECT_EQ(config.tissue.layers[1], (Layer{"RPE", 5e-6, 120400.0}));
  EXPECT_EQ(config.tissue.layers[3].absorption, 2000.0);
  EXPECT_EQ(config.plant.tissue, config.tissue);
  EXPECT_FALSE(config.plant.tissue_differs);
}

TEST(Overrides, LayersByNameInAFileAndIntoAnArray) {
  const TemporaryFolder folder;
  const Config table =
      load_config(folder.write("t.toml", "[tissue.layers.RPE]\nthickness_um = 5.0\n"), {});
  EXPECT_EQ(table, with({"tissue.layers.RPE.thickness_um=5"}));
  const std::string array = R"(tissue.peak_layer = "my layer"
tissue.layers = [{ name = "my layer", thickness_um = 10, absorption_per_m = 1e5 }])";
  const Config config =
      load_config(folder.write("a.toml", array), {"tissue.layers.'my layer'.scaled_by=alpha"});
  ASSERT_EQ(config.tissue.layers.size(), 1U);
  EXPECT_EQ(config.tissue.layers[0], (Layer{"my layer", 10e-6, 1e5, ScaledBy::kAlpha}));
}

TEST(PlantTissue, FollowsTheTissueWhereItIsNotGiven) {
  const TemporaryFolder folder;
  const std::string file = folder.write("c.toml", R"([plant.tissue]
spot_radius_um = 90.0
layers.RPE.thickness_um = 5.0
[tissue]
density_kg_per_m3 = 1000.0
)");
  const Config config = load_config(file, {"tissue.layers.choroid.thickness_um=300"});
  EXPECT_TRUE(config.plant.tissue_differs);
  EXPECT_EQ(config.tissue.spot_radius, 100e-6);
  EXPECT_EQ(config.tissue.layers[1].thickness, 6e-6);
  EXPECT_EQ(config.plant.tissue.spot_radius, 90e-6);
  EXPECT_EQ(config.plant.tissue.density, 1000.0);
  EXPECT_EQ(config.plant.tissue.layers[1].thickness, 5e-6);
  EXPECT_EQ(config.plant.tissue.layers[3].thickness, 300e-6);
}

TEST(PlantTissue, IsPrintedCompleteWhenGiven) {
  const TemporaryFolder folder;
  const Config config = with({"plant.tissue.layers.RPE.thickness_um=5"});
  const std::string text = to_toml(config);
  EXPECT_NE(text.find("[plant.tissue]"), std::string::npos);
  EXPECT_EQ(load_config(folder.write("c.toml", text), {}), config);
  // Complete: a later change of [tissue] does not reach it.
  const Config changed = load_config(folder / "c.toml", {"tissue.density_kg_per_m3=1000"});
  EXPECT_EQ(changed.plant.tissue.density, 993.0);
}

TEST(PlantTissue, WholeArrayOfLayersAndNothing) {
  const Config config =
      with({"plant.tissue.layers=[{name=\"RPE\", thickness_um=6, absorption_per_m=1e5, "
            "scaled_by=\"alpha\"}]"});
  EXPECT_EQ(config.tissue.layers.size(), 5U);
  EXPECT_EQ(config.plant.tissue.layers.size(), 1U);
  EXPECT_FALSE(with({"plant.tissue={}"}).plant.tissue_differs);
}

TEST(ModelFile, IsRelativeToTheFolderOfTheFileThatNamesIt) {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "sub");
  const std::string file = folder.write("sub/c.toml", "model.file = \"../a/./eye.json\"\n");
  EXPECT_EQ(load_config(file, {}).model.file, (folder.path() / "a/eye.json").string());
  const std::string absolute = folder.write("d.toml", "model.file = \"/x/../eye.json\"\n");
  EXPECT_EQ(load_config(absolute, {}).model.file, "/eye.json");
  EXPECT_EQ(load_config(file, {"model.file=eye.json"}).model.file,
            (fs::current_path() / "eye.json").string());
  EXPECT_EQ(load_config(file, {"model.file="}).model.file, "");
}

TEST(ModelFile, OfARelativeConfigurationFileIsAbsolute) {
  const TemporaryFolder folder;
  const std::string file = folder.write("c.toml", "model.file = \"eye.json\"\n");
  const std::string relative = fs::relative(file).string();
  EXPECT_EQ(load_config(relative, {}).model.file, folder / "eye.json");
}

TEST(Config, CyclesAreRounded) {
  EXPECT_EQ(with({"run.duration_ms=10", "control.period_ms=4"}).cycles(), 3U);
  EXPECT_EQ(with({"run.duration_ms=1"}).cycles(), 1U);
  EXPECT_EQ(with({"run.duration_ms=50000", "control.period_ms=0.05"}).cycles(), 1000000U);
}

}  // namespace
}  // namespace photocoag
