// Every key is used by some command; what a command does not use is said, what contradicts it
// refused.
#include "photocoag/config/usage.hpp"

#include <gtest/gtest.h>

#include "photocoag/config/fields.hpp"
#include "photocoag/core/files.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::TemporaryFolder;
using testing::thrown_by;

constexpr Use kUses[] = {Use::kSimulate,        Use::kTreat,      Use::kTreatEye,
                         Use::kTreatDriver,     Use::kEye,        Use::kResponseFull,
                         Use::kResponseReduced, Use::kReduce,     Use::kCompareReductions,
                         Use::kExport,          Use::kBoundaries, Use::kSchemeComparison,
                         Use::kEstimation,      Use::kSpots,      Use::kCalibrate,
                         Use::kExportC,         Use::kFmuEye,     Use::kFmuController};

std::vector<std::string> unused_of(Use use, const std::vector<std::string>& set,
                                   const std::string& file = "") {
  std::vector<UnusedKey> unused;
  load_config(file, set, use, unused);
  std::vector<std::string> keys;
  for (const UnusedKey& one : unused) keys.push_back(one.key);
  return keys;
}

TEST(Usage, EveryKeyIsUsedBySomeTreatmentAndByNotEveryCommand) {
  Config config;
  for (const Field& field : fields(config)) {
    const bool treats = uses(Use::kTreat, field.key) || uses(Use::kTreatEye, field.key);
    EXPECT_TRUE(treats) << field.key;
    int count = 0;
    for (const Use use : kUses) count += uses(use, field.key) ? 1 : 0;
    EXPECT_GE(count, 1) << field.key;
  }
}

TEST(Usage, WhatHasNoEffectIsSaidUnlessItIsTheDefault) {
  using Keys = std::vector<std::string>;
  EXPECT_EQ(unused_of(Use::kBoundaries, {"run.seed=5", "plant.noise_K=0.1", "grid.min_cells=2000"}),
            (Keys{"plant.noise_K", "run.seed"}));
  EXPECT_EQ(unused_of(Use::kSimulate, {"safety.core=1", "photoacoustics.pulse_period_ms=0.2"}),
            (Keys{"photoacoustics.pulse_period_ms", "safety.core"}));
  EXPECT_EQ(unused_of(Use::kSimulate, {"safety.core=-1", "run.hold_ms=100"}), Keys{});
  EXPECT_EQ(unused_of(Use::kTreatEye, {"safety.core=1", "photoacoustics.pulse_period_ms=0.2"}),
            Keys{});
  EXPECT_EQ(unused_of(Use::kTreatDriver, {"plant.absorption_factor=0.5", "plant.noise_K=0.3"}),
            Keys{"plant.absorption_factor"});
}

// An eye of its own process has pulses: what cannot be simulated there is refused by its name.
TEST(Usage, BenchKeysAreRefusedForAnEyeOfItsOwnProcess) {
  for (const char* option :
       {"plant.sample_averaging_periods=1", "plant.sample_lag_periods=0.5",
        "plant.power_lag_periods=0.5", "plant.power_readback=none", "plant.power_gain=1.1",
        "plant.sample_gain=0.9", "plant.sample_offset_K=1", "plant.absorption_drift_per_s=0.1"}) {
    const std::string key(option, std::string_view(option).find('='));
    for (const Use use : {Use::kTreatEye, Use::kEye}) {
      EXPECT_EQ(thrown_by([&] { unused_of(use, {option}); }).key, key);
    }
    for (const Use use : {Use::kSimulate, Use::kTreat, Use::kSpots}) {
      EXPECT_TRUE(unused_of(use, {option}).empty()) << key;
    }
    EXPECT_EQ(unused_of(Use::kTreatDriver, {option}), std::vector<std::string>{key});
  }
  const std::string told = "estimator.sample_averaging_periods";
  EXPECT_EQ(thrown_by([&] { unused_of(Use::kTreatEye, {told + "=1"}); }).key, told);
  EXPECT_TRUE(unused_of(Use::kTreatDriver, {told + "=1"}).empty());
}

TEST(Usage, KeysThatAnotherOneSwitchesOffAreSaidWithIt) {
  const std::pair<const char*, const char*> pairs[] = {
      {"control.osqp_tolerance=1e-4", ""},
      {"control.robust_sigma=3", "control.robust=certified"},
      {"estimator.window=10", "estimator.kind=mhe"},
      {"run.hold_ms=50", "run.goal=hold"},
      {"run.dose=2", "run.goal=dose"},
      {"safety.energy_max_mJ=100", "safety.supervisor=on"},
      {"safety.power_accuracy_relative=0.1", "safety.supervisor=on"},
      {"safety.sample_gain_accuracy_relative=0.1", "safety.supervisor=on"},
      {"model.choroid_max=3", "tissue.layers.choroid.scaled_by=beta"},
      {"estimator.choroid_max=3", "estimator.unknowns=rpe-and-choroid"}};
  for (const auto& [key, on] : pairs) {
    const std::string off =
        std::string(key).starts_with("safety") ? "safety.supervisor=off" : "run.seed=1";
    EXPECT_EQ(unused_of(Use::kSimulate, {key, off}).size(), 1U) << key;
    if (*on == '\0') continue;
    std::vector<std::string> set = {key, on};
    if (std::string(on).find("rpe-and") != std::string::npos) {
      set.push_back("tissue.layers.choroid.scaled_by=beta");
    }
    EXPECT_TRUE(unused_of(Use::kSimulate, set).empty()) << key;
  }
}

TEST(Usage, AnOptionThatContradictsItsCommandIsRefused) {
  std::vector<UnusedKey> unused;
  for (const std::string option : {"photoacoustics.sampling=instant", "plant.model=reduced",
                                   "tissue.volume_temperature=absorption-weighted",
                                   "plant.tissue.volume_temperature=absorption-weighted"}) {
    const ErrorParts error = thrown_by([&] { load_config("", {option}, Use::kTreatEye, unused); });
    EXPECT_EQ(error.key, option.substr(0, option.find('=')));
    EXPECT_EQ(error.where, "--set " + option);
    EXPECT_EQ(error.found, "\"" + option.substr(option.find('=') + 1) + "\"");
    EXPECT_FALSE(error.accepted.empty());
  }
  EXPECT_EQ(thrown_by([&] {
              load_config("", {"photoacoustics.sampling=pulses"}, Use::kSimulate, unused);
            }).key,
            "photoacoustics.sampling");
  EXPECT_EQ(thrown_by([&] { load_config("", {"control.robust=none"}, Use::kSpots, unused); }).key,
            "control.robust");
  // A complete file says everything: nothing in it was asked for against the command.
  const TemporaryFolder folder;
  write_file(folder.file("all.toml"), to_toml(Config{}));
  EXPECT_TRUE(unused_of(Use::kTreatEye, {}, folder.file("all.toml")).empty());
}

}  // namespace
}  // namespace photocoag
