// The numbers of summary.json from hand-made records.
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/run_csv.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace photocoag {
namespace {

Treatment with_peaks(const std::vector<double>& peaks, double period) {
  Treatment treatment;
  for (std::size_t k = 0; k < peaks.size(); ++k) {
    CycleRecord record;
    record.cycle = static_cast<std::int64_t>(k);
    record.time = static_cast<double>(k + 1) * period;
    record.truth.peak = peaks[k];
    record.measured = std::nan("");
    record.estimate.outputs.peak = peaks[k] + 0.5;
    record.estimate.absorption_factor = 1.21;
    record.decision.limit_active = k % 2 == 0;
    treatment.records.push_back(record);
  }
  treatment.outcome.cycles = peaks.size();
  return treatment;
}

TEST(Summary, CountsViolationsTimeErrorAndDose) {
  Config config;  // reference 30 K, limit 32 K, true alpha 1.1, ambient 22 C
  config.control.period = 0.02;
  const RunSummaryNumbers numbers =
      summarize(config, with_peaks({20.0, 28.5, 33.0, 32.0, 31.0}, 0.02));
  EXPECT_EQ(numbers.peak_true_max, 33.0);
  EXPECT_EQ(numbers.peak_estimate_max, 33.5);
  EXPECT_EQ(numbers.limit_violations, 1U);  // 32.0 is not above the limit
  EXPECT_EQ(numbers.limit_active_cycles, 3U);
  EXPECT_DOUBLE_EQ(numbers.time_to_95_percent.value(), 0.04);
  EXPECT_NEAR(numbers.rms_error_after_50_ms.value(), std::sqrt((9.0 + 4.0 + 1.0) / 3.0), 1e-12);
  EXPECT_NEAR(numbers.absorption_error_final.value(), 0.1, 1e-12);
  EXPECT_TRUE(numbers.stopped_for.empty());
  EXPECT_EQ(numbers.dark_since, 0U);
  Treatment lit = with_peaks({20.0, 28.5, 33.0, 32.0, 31.0}, 0.02);
  lit.records[0].power = lit.records[2].power = 0.01;
  EXPECT_EQ(summarize(config, lit).dark_since, 3U) << "not the cycles that were recorded after it";
  // 60 ms between 52 and 55 C: between the isothermal doses at these temperatures.
  const ArrheniusParameters& schlott = kPublishedDamage[0];
  EXPECT_GT(numbers.thermal_dose[0], 0.05 * damage_rate(schlott, 52.0));
  EXPECT_LT(numbers.thermal_dose[0], 0.08 * damage_rate(schlott, 55.0));
}

TEST(Summary, WhatNeverHappenedIsNull) {
  const RunSummaryNumbers numbers = summarize(Config{}, with_peaks({1.0, 2.0}, 1e-3));
  EXPECT_FALSE(numbers.time_to_95_percent.has_value());
  EXPECT_FALSE(numbers.rms_error_after_50_ms.has_value());
}

TEST(RunCsv, MissingSamplesAreEmptyCells) {
  const std::string csv = run_csv(with_peaks({1.0}, 1e-3));
  EXPECT_NE(csv.find("\n0,0.001,0,0,,0,1,1.5,1.21,"), std::string::npos) << csv;
}

TEST(RunCsv, TheChoroidComesLastAndOnlyIfItIsEstimated) {
  Treatment treatment = with_peaks({1.0}, 1e-3);
  treatment.records[0].estimate.choroid_factor = 1.25;
  treatment.records[0].estimate.choroid_sigma = 0.5;
  EXPECT_EQ(run_csv(treatment).find("choroid"), std::string::npos);
  const std::string csv = run_csv(treatment, true);
  EXPECT_NE(csv.find(",sample_verdict,choroid_estimate,choroid_sigma\n"), std::string::npos) << csv;
  EXPECT_TRUE(csv.ends_with(",1.25,0.5\n")) << csv;

  Config config;
  config.plant.choroid_factor = 2.0;
  EXPECT_FALSE(summarize(config, treatment).choroid_error_final.has_value());
  config.estimator.unknowns = Unknowns::kRpeAndChoroid;
  EXPECT_DOUBLE_EQ(summarize(config, treatment).choroid_error_final.value(), 1.25 / 2.0 - 1.0);
}

TEST(RunFolder, RefusesAFolderWithContent) {
  EXPECT_THROW(check_run_folder(std::filesystem::path(PHOTOCOAG_SOURCE_DIR) / "src"),
               std::exception);
  EXPECT_NO_THROW(check_run_folder("/nowhere/yet"));
}

}  // namespace
}  // namespace photocoag
