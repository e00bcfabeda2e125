#include "photocoag/session/learning_study.hpp"

#include <array>
#include <cmath>
#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/core/parallel.hpp"
#include "photocoag/population/eye_models.hpp"
#include "photocoag/population/statistics.hpp"
#include "photocoag/session/learning.hpp"

namespace photocoag {
namespace {

struct Measure {
  const char* name;
  const char* unit;
};
constexpr std::array<Measure, 7> kMeasures = {{
    {"time to 95 %", "ms"},
    {"spots at 95 % within 3 ms", "%"},
    {"spots that never get to 95 %", "%"},
    {"estimated minus true peak, rms, first 5 ms", "K"},
    {"highest true peak minus reference", "K"},
    {"spots over the limit", "%"},
    {"held peak minus reference, second half", "K"},
}};
constexpr std::size_t kRoot = 3;  // the measure that is a root of a mean of squares
using Means = std::array<double, kMeasures.size()>;

constexpr double kEarly = 0.0055;  // s: 5 ms with rounding
constexpr double kSoon = 3.5;      // ms

// Sums over the spots of a session.
struct Sums {
  Means sum{};
  Means count{};

  void add(std::size_t measure, double value) {
    if (!std::isfinite(value)) return;
    sum[measure] += value;
    count[measure] += 1.0;
  }
  Means means() const {
    Means all{};
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = sum[k] / count[k];
    all[kRoot] = std::sqrt(all[kRoot]);
    return all;
  }
};

void measure(const Config& config, const Treatment& treatment, const AttemptOutcome& outcome,
             Sums& sums) {
  sums.add(0, outcome.time_to_95_ms);
  sums.add(1, outcome.time_to_95_ms <= kSoon ? 100.0 : 0.0);
  sums.add(2, std::isnan(outcome.time_to_95_ms) ? 100.0 : 0.0);
  for (const CycleRecord& record : treatment.records) {
    if (record.time > kEarly) break;
    const double error = record.estimate.outputs.peak - record.truth.peak;
    sums.add(kRoot, error * error);
  }
  sums.add(4, outcome.peak_true_max_K - config.control.peak_reference);
  sums.add(5, outcome.ending == SpotEnding::kOverLimit ? 100.0 : 0.0);
  sums.add(6, outcome.held_error_K);
}

Means session_means(const Session& session, const std::vector<Config>& configs,
                    const EyeModels& shared, bool learn) {
  std::vector<AttemptOutcome> earlier;
  Sums sums;
  for (std::size_t k = 0; k < configs.size(); ++k) {
    Config config = configs[k];
    if (learn) config.estimator = learnt(config.estimator, earlier, session.learn_floor);
    EyeModel eye = shared.eye();
    if (shared.full && !(shared.full->tissue() == config.plant.tissue)) {
      eye.full = std::make_shared<const FullOrderModel>(*shared.full, config.plant.tissue);
    }
    const Treatment treatment = treat_eye(config, shared.reduced, eye);
    earlier.push_back(outcome_of(config, treatment));
    if (k > 0) measure(config, treatment, earlier.back(), sums);
  }
  return sums.means();
}

}  // namespace

LearningStudy learning_study(const Session& session, std::size_t count, bool use_cache) {
  if (session.spots.size() < 2 || !session.place.here()) {
    throw Error(ErrorParts{.where = session.file,
                           .problem = "there is nothing to learn from",
                           .accepted = "--study of two spots or more on simulated eyes"});
  }
  const EyeModels shared = make_eye_models(session.configs.front(), use_cache);
  std::vector<std::array<Means, 2>> all(count);
  for_each_in_parallel(count, [&](std::size_t k) {
    const std::vector<Config> configs = session_configs(session, session.seed + k);
    for (const bool learn : {false, true}) {
      all[k][learn ? 1 : 0] = session_means(session, configs, shared, learn);
    }
  });
  LearningStudy study{.sessions = count, .spots = session.spots.size(), .rows = {}};
  for (std::size_t m = 0; m < kMeasures.size(); ++m) {
    std::vector<double> without, with, difference;
    for (const auto& [plain, learning] : all) {
      if (!std::isfinite(plain[m]) || !std::isfinite(learning[m])) continue;  // no spot had a value
      without.push_back(plain[m]);
      with.push_back(learning[m]);
      difference.push_back(learning[m] - plain[m]);
    }
    const auto [mean, deviation] = mean_and_deviation(difference);
    const auto pairs = static_cast<double>(difference.size());
    study.rows.push_back({.measure = kMeasures[m].name,
                          .unit = kMeasures[m].unit,
                          .without = mean_and_deviation(without).first,
                          .with = mean_and_deviation(with).first,
                          .difference = mean,
                          .difference_error = deviation / std::sqrt(pairs)});
  }
  return study;
}

}  // namespace photocoag
