// Printing a configuration and reading it again gives every bit back.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "config/temporary_folder.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/config/decimal.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

double draw(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * std::generate_canonical<double, 53>(random);
}

void randomize(Tissue& tissue, std::mt19937_64& random) {
  tissue.ambient_celsius = draw(random, -10.0, 60.0);
  tissue.spot_radius = draw(random, 10e-6, 400e-6);
  tissue.domain_radius = draw(random, 1e-3, 19e-3);
  tissue.density = draw(random, 800.0, 1200.0);
  tissue.transmission = draw(random, 0.1, 1.0);
  tissue.volume_temperature = static_cast<VolumeTemperature>(random() % 2);
  tissue.layers.assign(1 + random() % 32, Layer{});
  tissue.beam = static_cast<BeamProfile>(random() % 3);
  tissue.beam_radii.clear();
  tissue.beam_intensities.clear();
  if (tissue.beam == BeamProfile::kTable) {
    double radius = 0.0;
    for (std::uint64_t i = 0, count = 2 + random() % 5; i < count; ++i) {
      tissue.beam_radii.push_back(radius += draw(random, 1e-6, 100e-6));
      tissue.beam_intensities.push_back(draw(random, 0.1, 2.0));
    }
  }
  int number = 0;
  for (Layer& layer : tissue.layers) {
    layer.name = "la\"y\\er é " + std::to_string(number++);
    layer.thickness = draw(random, 1e-7, 19e-3);
    layer.absorption = std::pow(10.0, draw(random, -30.0, 6.9));
    layer.scaled_by = ScaledBy(random() % (kMaxParameters + 1));
    if (random() % 2 == 0) layer.conductivity = draw(random, 0.1, 1.0);
    if (random() % 2 == 0) layer.density = draw(random, 800.0, 1200.0);
    if (random() % 2 == 0) layer.heat_capacity = draw(random, 2000.0, 4200.0);
    if (random() % 2 == 0) layer.perfusion = std::pow(10.0, draw(random, 0.0, 7.9));
  }
  tissue.layers[0].scaled_by = ScaledBy::kAlpha;  // one has to
  tissue.peak_layer = tissue.layers[random() % tissue.layers.size()].name;
}

Config random_config(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Config c;
  c.control.period = draw(random, 5.1e-5, 99e-3);
  c.control.horizon = static_cast<int>(2 + random() % 49);
  c.control.peak_reference = draw(random, 1e-9, 70.0);
  c.control.peak_max = draw(random, 71.0, 149.0);
  c.control.power_max = draw(random, 0.5, 1.0);
  c.control.power_min = draw(random, 0.0, 0.4);
  c.control.power_weight = std::pow(10.0, draw(random, 0.0, 8.9));
  c.control.state_weight = static_cast<StateWeight>(random() % 2);
  c.estimator.absorption_process_noise = std::pow(10.0, draw(random, -300.0, -1.1));
  c.estimator.absorption_initial = draw(random, 0.2, 2.0);
  c.estimator.choroid_initial = draw(random, 0.4, 2.5);
  c.estimator.unknowns = static_cast<Unknowns>(random() % 2);
  c.model.reduction.choroid_max = draw(random, 0.6, 20.0);
  c.model.file = "/a b/\"quoted\"\\back/é" + std::to_string(seed);
  c.model.reduction.order = static_cast<int>(1 + random() % 14);
  c.model.discretization = static_cast<Discretization>(random() % 3);
  c.grid.min_cells = 1000 + random() % 900'000;
  randomize(c.tissue, random);
  c.plant.tissue = c.tissue;
  c.plant.tissue_differs = random() % 2 == 0;
  if (c.plant.tissue_differs) randomize(c.plant.tissue, random);
  c.plant.model = static_cast<PlantModel>(random() % 2);
  c.plant.absorption_factor = draw(random, 0.05, 5.0);
  if (c.plant.tissue.two_parameters()) c.plant.choroid_factor = draw(random, 0.05, 20.0);
  c.run.duration = draw(random, 0.1, 49.0);
  c.run.seed = random() >> 1U;
  return c;
}

TEST(ConfigRoundTrip, Defaults) {
  const TemporaryFolder folder;
  const std::string text = to_toml(Config{});
  EXPECT_EQ(load_config(folder.write("c.toml", text), {}), Config{});
  EXPECT_EQ(to_toml(load_config(folder / "c.toml", {})), text);
  EXPECT_EQ(text.find("plant.tissue"), std::string::npos);
  EXPECT_NE(text.find("Research software, not a medical device"), std::string::npos);
}

TEST(ConfigRoundTrip, RandomConfigurations) {
  const TemporaryFolder folder;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Config config = random_config(seed);
    const std::string text = to_toml(config);
    const Config read = load_config(folder.write("c.toml", text), {});
    ASSERT_EQ(read, config) << "seed " << seed << "\n" << text;
    ASSERT_EQ(to_toml(read), text);
  }
}

TEST(ConfigRoundTrip, EveryKeyIsPrintedWithAComment) {
  Config config = random_config(1);
  config.plant.tissue_differs = true;
  const std::string text = to_toml(config);
  for (const Field& field : fields(config)) {
    const std::string name = field.key.substr(field.key.find_last_of('.') + 1);
    const std::size_t at = text.find("\n" + name + " ");
    ASSERT_NE(at, std::string::npos) << field.key;
    if (name == "layers") continue;  // its comment is above it
    EXPECT_NE(text.substr(at + 1, text.find('\n', at + 1) - at).find("  # "), std::string::npos)
        << field.key;
  }
}

TEST(ConfigRoundTrip, NoiseKeysSayThatTheyAreStandardDeviations) {
  const std::string text = to_toml(Config{});
  for (const char* key : {"absorption_sigma_initial", "absorption_process_noise",
                          "power_process_noise_W", "measurement_noise_K", "noise_K"}) {
    const std::size_t at = text.find(std::string("\n") + key);
    ASSERT_NE(at, std::string::npos) << key;
    const std::string line = text.substr(at + 1, text.find('\n', at + 1) - at);
    EXPECT_NE(line.find("standard deviation"), std::string::npos) << line;
  }
}

TEST(ConfigRoundTrip, HashIsOfTheText) {
  const Config config = random_config(7);
  EXPECT_EQ(config_sha256(config), sha256_hex(to_toml(config)));
  Config other = config;
  other.run.seed ^= 1U;
  EXPECT_NE(config_sha256(other), config_sha256(config));
}

TEST(ConfigRoundTrip, EyeThatDiffersIsNeverHidden) {
  Config config;
  config.plant.tissue.spot_radius = 90e-6;  // set by a program that forgot tissue_differs
  EXPECT_NE(to_toml(config).find("[plant.tissue]"), std::string::npos);
}

TEST(Decimal, EveryDoubleHasATextInEveryUnit) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value) || std::abs(value) > 1e300) continue;
    for (const int exponent : {0, -3, -6}) {
      const std::string text = shortest_decimal(value, exponent);
      ASSERT_EQ(scaled_decimal(text, exponent), value) << text << " e" << exponent;
    }
  }
}

TEST(Decimal, Spellings) {
  EXPECT_EQ(scaled_decimal("6.0", -6), 6.0e-6);
  EXPECT_EQ(scaled_decimal("+1_000.5E+2", -3), 100.05);
  EXPECT_EQ(scaled_decimal("-0.5e-3", 0), -0.5e-3);
  EXPECT_FALSE(std::signbit(scaled_decimal("-0.0", 0)));
  EXPECT_EQ(scaled_decimal("1e-999999999999", 0), 0.0);
  EXPECT_EQ(scaled_decimal("5e-324", 0), 5e-324);
  EXPECT_EQ(shortest_decimal(1e-3, -3), "1.0");
  EXPECT_EQ(shortest_decimal(400e-6, -6), "400.0");
  EXPECT_EQ(shortest_decimal(1e-5, 0), "1e-5");
  EXPECT_EQ(shortest_decimal(1.25e-7, 0), "1.25e-7");
  EXPECT_EQ(shortest_decimal(-0.001, 0), "-0.001");
  EXPECT_EQ(shortest_decimal(-0.0, 0), "0.0");
  EXPECT_EQ(shortest_decimal(120400.0, 0), "120400.0");
  EXPECT_EQ(shortest_decimal(1e22, 0), "1e22");
  EXPECT_EQ(shortest_decimal(INFINITY, 0), "inf");
}

}  // namespace
}  // namespace photocoag
