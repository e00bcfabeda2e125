// [[prior]]: read, printed, hashed, and refused with place, key, value and what is accepted.
#include "photocoag/config/prior.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "config/temporary_folder.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/config/random_quantities.hpp"
#include "photocoag/config/usage.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::thrown_by;

std::string table(const std::string& key, const std::string& rest) {
  return "[[prior]]\nkey = \"" + key + "\"\n" + rest;
}
std::string normal(const std::string& key, const std::string& mean, const std::string& sigma,
                   const std::string& low, const std::string& high) {
  return table(key, "distribution = \"normal\"\nmean = " + mean + "\nsigma = " + sigma +
                        "\nlow = " + low + "\nhigh = " + high + "\n");
}
const std::string kAlpha = normal("plant.absorption_factor", "0.7363", "0.25", "0.35", "1.5");
const std::string kRadius = normal("plant.tissue.spot_radius_um", "100", "4", "88", "112");
const std::string kTransmission =
    table("plant.tissue.transmission",
          "distribution = \"uniform\"\nlow = 0.85\nhigh = 1.0\nuse = \"considered\"\n");
const std::string kChoroid =
    table("plant.tissue.layers.choroid.absorption_per_m",
          "distribution = \"log-normal\"\nmedian = 2662.2\nsigma_log = 0.3\nlow = 1000\n"
          "high = 8000\n");

std::string between(const std::string& first, const std::string& second, const std::string& value) {
  return "[[prior_correlation]]\nbetween = [\"" + first + "\", \"" + second +
         "\"]\nvalue = " + value + "\n";
}

class PriorFile : public ::testing::Test {
 protected:
  Config load(const std::string& text, const std::vector<std::string>& set = {}) const {
    return load_config(folder_.write("c.toml", text), set);
  }
  ErrorParts refused(const std::string& text, const std::vector<std::string>& set = {}) const {
    return thrown_by([&] { load(text, set); });
  }
  TemporaryFolder folder_;
};

TEST_F(PriorFile, ComesBackFromItsPrintedFormAndIsInTheHash) {
  const Config config = load(
      kAlpha + kRadius + kTransmission + kChoroid +
      between("plant.absorption_factor", "plant.tissue.layers.choroid.absorption_per_m", "0.4"));
  ASSERT_EQ(config.prior.quantities.size(), 4U);
  EXPECT_TRUE(config.prior.find("plant.tissue.transmission")->considered);
  EXPECT_FALSE(config.prior.find("plant.tissue.spot_radius_um")->considered);
  EXPECT_EQ(config.prior.find("plant.tissue.spot_radius_um")->center, 100.0) << "the key's unit";
  const std::string text = to_toml(config);
  EXPECT_EQ(load(text), config) << text;
  EXPECT_EQ(to_toml(load(text)), text);
  Config other = config;
  other.prior.quantities[0].spread = 0.26;
  EXPECT_NE(config_sha256(other), config_sha256(config));
  const Eigen::MatrixXd correlation = correlation_matrix(config.prior, kPriorTables);
  EXPECT_EQ(correlation(0, 3), 0.4);
  EXPECT_EQ(correlation(3, 0), 0.4);
  EXPECT_EQ(correlation(1, 1), 1.0);
  EXPECT_EQ(correlation(0, 1), 0.0);
}

TEST_F(PriorFile, AnOptionReplacesAllOfIt) {
  const std::string text =
      kAlpha + kRadius + between("plant.absorption_factor", "plant.tissue.spot_radius_um", "0.1");
  EXPECT_EQ(load(text, {"prior=[]"}).prior, Prior{});
  const Config one = load(text, {"prior=[{key=\"plant.noise_K\", distribution=\"uniform\", "
                                 "low=0.1, high=0.5}]"});
  EXPECT_EQ(one.prior.quantities.size(), 1U);
  EXPECT_TRUE(one.prior.correlations.empty());
}

TEST_F(PriorFile, WithoutOneNothingIsPrinted) {
  EXPECT_EQ(to_toml(load("")).find("\n[[prior"), std::string::npos);
}

struct Bad {
  std::string text;
  std::string key;
  std::string found;
  std::string accepted;  // a part
  int line;
};

TEST_F(PriorFile, BadOnesAreRefusedWithPlaceKeyAndValue) {
  const std::string alpha = "prior.plant.absorption_factor";
  const std::vector<Bad> all = {
      {normal("plant.absorption_factor", "0.7", "0", "0.3", "1.5"), alpha + ".sigma", "0",
       "a number above 0", 5},
      {normal("plant.absorption_factor", "0.7", "-0.1", "0.3", "1.5"), alpha + ".sigma", "-0.1",
       "a number above 0", 5},
      {normal("plant.absorption_factor", "0.7", "0.1", "1.5", "1.5"), alpha + ".high", "1.5",
       "above low = 1.5", 7},
      {normal("plant.absorption_factor", "2.7", "0.1", "0.3", "1.5"), alpha + ".mean", "2.7",
       "from low = 0.3 to high = 1.5", 4},
      {normal("plant.absorption_factor", "0.7", "0.1", "0.01", "1.5"), alpha + ".low", "0.01",
       "a number from 0.05 to 5", 6},
      {normal("plant.noise_K", "0.3", "0.1", "0", "1.5"), "prior.plant.noise_K.low", "0",
       "a number above 0", 6},
      {normal("plant.absorption_factor", "0.7", "nan", "0.3", "1.5"), alpha + ".sigma", "nan",
       "a finite number", 5},
      {table("plant.absorption_factor", "distribution = \"gamma\"\nlow = 0\nhigh = 1\n"),
       alpha + ".distribution", "\"gamma\"", "\"log-normal\"", 3},
      {table("plant.absorption_factor",
             "distribution = \"uniform\"\nmean = 1.0\nlow = 0.5\nhigh = 1\n"),
       alpha + ".mean", "1.0", "a uniform one has low and high", 4},
      {normal("plant.absorption_factor", "0.7", "0.1", "0.3", "1.5") + "use = \"maybe\"\n",
       alpha + ".use", "\"maybe\"", "\"considered\"", 8},
      {normal("plant.absorption_factor", "0.7", "0.1", "0.3", "1.5") + "unit = \"1\"\n",
       "prior.unit", "", "distribution", 8},
      {kAlpha + kAlpha, "prior.key", "\"plant.absorption_factor\"", "each key once", 9},
      {normal("plant.tissue.transmission", "0.9", "0.1", "0.8", "1.2"),
       "prior.plant.tissue.transmission.high", "1.2", "above 0, at most 1", 7},
      {normal("plant.choroid_factor", "1", "0.1", "0.8", "1.2"), "prior.plant.choroid_factor",
       "\"plant.choroid_factor\"", "plant.absorption_factor", 2},
      {normal("control.horizon", "5", "1", "2", "9"), "prior.control.horizon",
       "\"control.horizon\"", "plant.absorption_factor", 2},
      {normal("plant.tissue.layers.sclera.thickness_um", "700", "10", "600", "800"),
       "prior.plant.tissue.layers.sclera.thickness_um",
       "\"plant.tissue.layers.sclera.thickness_um\"", "not of the last layer", 2},
      {normal("plant.tissue.layers.nail.thickness_um", "7", "1", "6", "8"),
       "prior.plant.tissue.layers.nail.thickness_um", "\"plant.tissue.layers.nail.thickness_um\"",
       "NAME", 2},
      {"[tissue.layers.retina]\nconductivity_W_per_mK = 0.5\n" +
           normal("plant.tissue.conductivity_W_per_mK", "0.6", "0.02", "0.5", "0.7"),
       "prior.plant.tissue.conductivity_W_per_mK", "\"plant.tissue.conductivity_W_per_mK\"",
       "all layers alike", 4},
      {normal("calibration_factor", "1", "0.1", "0", "2"), "prior.calibration_factor.low", "0",
       "a number above 0", 6},
      {kAlpha + kRadius + between("plant.absorption_factor", "plant.noise_K", "0.1"),
       "prior_correlation.between", "[…]", "two keys of [[prior]]", 16},
      {kAlpha + kRadius + between("plant.absorption_factor", "plant.tissue.spot_radius_um", "1"),
       "prior_correlation.value", "1", "above -1, below 1", 17},
      {kAlpha + kRadius + kTransmission +
           between("plant.absorption_factor", "plant.tissue.spot_radius_um", "0.9") +
           between("plant.absorption_factor", "plant.tissue.transmission", "0.9") +
           between("plant.tissue.spot_radius_um", "plant.tissue.transmission", "-0.9"),
       "prior_correlation", "0.9, 0.9, -0.9", "positive definite", 21},
  };
  for (const Bad& bad : all) {
    const ErrorParts error = refused(bad.text);
    EXPECT_EQ(error.key, bad.key) << bad.text;
    EXPECT_EQ(error.found, bad.found) << bad.text;
    EXPECT_NE(error.accepted.find(bad.accepted), std::string::npos) << error.accepted << bad.text;
    EXPECT_TRUE(error.where.ends_with("c.toml:" + std::to_string(bad.line))) << error.where << "\n"
                                                                             << bad.text;
  }
  EXPECT_EQ(refused(between("a", "b", "0.1")).key, "prior_correlation");
}

TEST_F(PriorFile, ChanceNeedsOneAndRefusesWhatItDoesNotGoWith) {
  const std::string chance = "control.robust=chance";
  EXPECT_EQ(load(kAlpha, {chance}).control.robust, Robustness::kChance);
  ErrorParts error = refused("", {chance});
  EXPECT_EQ(error.key, "control.robust");
  EXPECT_EQ(error.found, "\"chance\"");
  EXPECT_NE(error.accepted.find("[[prior]]"), std::string::npos);
  const std::pair<const char*, const char*> clashes[] = {
      {"uncertainty.thickness_relative=0.1", "control.robust"},
      {"estimator.kind=mhe", "estimator.kind"},
      {"control.solve_every=2", "control.solve_every"},
      {"control.solver=osqp-condensed", "control.solver"},
      {"model.discretization=implicit-euler", "model.discretization"}};
  for (const auto& [option, key] : clashes) {
    if (std::string(key) == "control.solver" && PHOTOCOAG_HAS_OSQP == 0) continue;
    EXPECT_EQ(refused(kAlpha, {chance, option}).key, key) << option;
  }
  EXPECT_EQ(refused(kAlpha, {chance, "tissue.layers.choroid.scaled_by=beta",
                             "estimator.unknowns=rpe-and-choroid"})
                .key,
            "estimator.unknowns");
  EXPECT_EQ(refused(kAlpha, {"control.identification_ms=5"}).key, "control.identification_ms");
  EXPECT_EQ(
      refused(kAlpha, {chance, "control.identification_ms=5", "control.power_max_W=0.01"}).key,
      "control.identification_power_W");
  EXPECT_EQ(refused("", {"control.limit_probability=1e-7"}).key, "control.limit_probability");
}

TEST_F(PriorFile, WhatHasNoEffectIsSaidOnce) {
  const auto unused = [this](const std::vector<std::string>& set) {
    std::vector<UnusedKey> list;
    load_config(folder_.write("c.toml", kAlpha + kRadius), set, Use::kSimulate, list);
    std::vector<std::string> keys;
    for (const UnusedKey& one : list) keys.push_back(one.key);
    return keys;
  };
  using Keys = std::vector<std::string>;
  EXPECT_EQ(unused({}), Keys{"prior"});
  EXPECT_EQ(unused({"control.limit_probability=0.01"}),
            (Keys{"control.limit_probability", "prior"}));
  EXPECT_EQ(unused({"control.robust=chance", "control.limit_probability=0.01"}), Keys{});
  EXPECT_EQ(unused({"control.robust=chance", "estimator.absorption_initial=0.8"}),
            Keys{"estimator.absorption_initial"});
}

TEST(RandomQuantity, MomentsAreThoseOfTheTruncatedDistribution) {
  const RandomQuantity uniform{.key = "u", .low = 0.85, .high = 1.0};
  EXPECT_NEAR(moments(uniform).mean, 0.925, 1e-12);
  EXPECT_NEAR(moments(uniform).deviation, 0.15 / std::sqrt(12.0), 1e-12);
  // E log u = (b log b - a log a) / (b - a) - 1.
  EXPECT_NEAR(log_moments(uniform).mean, (0.0 - 0.85 * std::log(0.85)) / 0.15 - 1.0, 1e-12);
  // Cut at its mean a normal one is half-normal: sigma sqrt(2 / pi), sigma^2 (1 - 2 / pi).
  const double pi = 3.14159265358979323846;
  const RandomQuantity half{.key = "h",
                            .distribution = Distribution::kNormal,
                            .center = 2.0,
                            .spread = 0.5,
                            .low = 2.0,
                            .high = 100.0};
  EXPECT_NEAR(moments(half).mean, 2.0 + 0.5 * std::sqrt(2.0 / pi), 1e-9);
  EXPECT_NEAR(moments(half).deviation, 0.5 * std::sqrt(1.0 - 2.0 / pi), 1e-9);
  // Hardly cut: exp(s^2 / 2) and sqrt(exp(s^2) - 1) of the median.
  const RandomQuantity wide{.key = "w",
                            .distribution = Distribution::kLogNormal,
                            .center = 3.0,
                            .spread = 0.3,
                            .low = 1e-3,
                            .high = 1e3};
  EXPECT_NEAR(moments(wide).mean, 3.0 * std::exp(0.045), 1e-9);
  EXPECT_NEAR(moments(wide).deviation, 3.0 * std::exp(0.045) * std::sqrt(std::exp(0.09) - 1.0),
              1e-9);
  EXPECT_NEAR(log_moments(wide).mean, std::log(3.0), 1e-12);
  EXPECT_NEAR(log_moments(wide).deviation, 0.3, 1e-9);
}

}  // namespace
}  // namespace photocoag
