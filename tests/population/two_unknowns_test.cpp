// Two unknown absorption factors from configuration to closed loop.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "loop/treatments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/population/unknowns_study.hpp"
#include "photocoag/report/run_figures.hpp"
#include "photocoag/run/run_folder.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

Config two_unknowns(std::vector<std::string> more = {}) {
  more.insert(more.begin(), "grid.min_cells=4000");  // the loop plays the part, not the accuracy
  return shipped("two-unknowns.toml", more);
}

ModelStore& store() {
  static ModelStore models(two_unknowns(), true);
  return models;
}

// No eye overheats, none is stopped, and both factors are found.
TEST(TwoUnknownsLoop, HoldsThePeakOfEyesWithAnyChoroid) {
  for (const char* kind : {"ekf", "mhe"}) {
    for (const char* supervisor : {"on", "off"}) {
      for (const double alpha : {0.5, 1.1}) {
        for (const double beta : {0.5, 1.0, 2.0}) {
          SCOPED_TRACE(std::string(kind) + ", supervisor " + supervisor + ", alpha " +
                       std::to_string(alpha) + ", beta " + std::to_string(beta));
          const Config config = two_unknowns({std::string("estimator.kind=") + kind,
                                              std::string("safety.supervisor=") + supervisor,
                                              "plant.absorption_factor=" + std::to_string(alpha),
                                              "plant.choroid_factor=" + std::to_string(beta)});
          const Treatment treatment =
              simulate_eye(config, store().reduced(), {.full = store().plant_full()});
          const RunSummaryNumbers numbers = summarize(config, treatment);
          EXPECT_EQ(numbers.stopped_for, "");
          EXPECT_EQ(numbers.limit_violations, 0U);
          EXPECT_LT(numbers.rms_error_after_50_ms.value(), 0.6);
          // Errors of one noise: some 2 and 4 % rms over many eyes.
          EXPECT_LT(std::abs(numbers.absorption_error_final.value()), 0.08);
          EXPECT_LT(std::abs(numbers.choroid_error_final.value()), 0.15);
        }
      }
    }
  }
}

TEST(TwoUnknownsLoop, RunFolderAndFiguresHaveBoth) {
  const TemporaryFolder folder;
  const Config config = two_unknowns({"run.duration_ms=60"});
  const Treatment treatment = treat(config, store());
  const std::filesystem::path run = folder.path() / "run";
  const ClaimedFolder claimed = open_run_folder(run, config);
  write_run(run, config, treatment);
  const std::string csv = read_file((run / "run.csv").string(), 1 << 20);
  const std::string json = read_file((run / "summary.json").string(), 1 << 20);
  EXPECT_TRUE(nlohmann::json::parse(json)["choroid_error_final"].is_number());
  const RunLog log = parse_run_log(csv, "run.csv");
  ASSERT_EQ(log.choroid_estimate.size(), log.cycles());
  EXPECT_EQ(log.choroid_estimate.back(), treatment.records.back().estimate.choroid_factor);
  const RunConfig shown = parse_run_config(to_toml(config), "config.toml");
  EXPECT_EQ(shown.choroid_true, 1.4);
  const auto figures = run_figures(log, parse_run_summary(json, "summary.json"), shown,
                                   {.from_ms = 0.0, .to_ms = 60.0});
  EXPECT_EQ(figures.size(), 6U);
}

// 250 Hz without penalties: the first powers decide, and neither factor is known then.
TEST(TwoUnknownsLoop, RobustControlKeepsTheLimit) {
  const std::vector<std::string> plain{"control.period_ms=4", "run.duration_ms=100",
                                       "safety.supervisor=off"};
  ModelStore models(two_unknowns(plain), true);
  int nominal_over = 0;
  for (const std::string alpha : {"0.4", "1.5"}) {
    for (const std::string beta : {"0.5", "2.0"}) {
      std::vector<std::string> settings = plain;
      settings.push_back("plant.absorption_factor=" + alpha);
      settings.push_back("plant.choroid_factor=" + beta);
      const Config nominal = two_unknowns(settings);
      settings.push_back("control.robust=certified");
      const Config robust = two_unknowns(settings);
      if (outcome(nominal, treat(nominal, models).records).violations > 0) ++nominal_over;
      const Outcome guarded = outcome(robust, treat(robust, models).records);
      EXPECT_EQ(guarded.violations, 0) << alpha << ' ' << beta;
      EXPECT_LE(guarded.time_to_95, 0.08) << alpha << ' ' << beta;
    }
  }
  EXPECT_EQ(nominal_over, 2) << "of alpha 1.5";
}

TEST(UnknownsStudy, AnUnknownChoroidMattersAndTwoUnknownsMendIt) {
  const Config config = two_unknowns();
  const auto result_of = [&](const std::string& name) {
    for (const UnknownsCase& which : unknowns_cases(config)) {
      if (which.name == name) return unknowns_study(config, store(), which, 40).over(50, 250);
    }
    ADD_FAILURE() << name;
    return UnknownsCycle{};
  };
  const UnknownsCycle known = result_of("ekf, one unknown, choroid known");
  const UnknownsCycle assumed = result_of("ekf, one unknown, choroid assumed 1");
  const UnknownsCycle two = result_of("ekf, two unknowns");
  const UnknownsCycle mhe = result_of("mhe, two unknowns");
  // Seen over 200 eyes: 0.12 K, 1.41 K, 0.16 K and 0.14 K.
  EXPECT_LT(known.peak, 0.2);
  EXPECT_GT(assumed.peak, 0.8);
  EXPECT_LT(two.peak, 0.3);
  EXPECT_LT(mhe.peak, 0.3);
  EXPECT_LT(two.beta, 0.12);
  EXPECT_LT(mhe.beta, two.beta);
  const UnknownsCycle dark = result_of("mhe, two unknowns, no light");
  EXPECT_GT(dark.beta, 0.3) << "nothing is seen without light";
}

TEST(UnknownsStudy, NeedsAModelWithBoth) {
  Config config;
  config.grid.min_cells = 2000;
  ModelStore models(config, true);
  EXPECT_THROW(unknowns_study(config, models, unknowns_cases(config).front(), 1), Error);
}

}  // namespace
}  // namespace photocoag::testing
