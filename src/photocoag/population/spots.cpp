#include "photocoag/population/spots.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string_view>
#include <utility>

#include "photocoag/core/parallel.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/population/eye_models.hpp"
#include "photocoag/run/declared_eye.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {
namespace {

// Number i of spot `seed`, uniform over [low, high].
double draw(std::uint64_t seed, std::uint64_t i, double low, double high) {
  return low + (high - low) * uniform(seed, i, RandomStream::kRandomSpot);
}

double random_alpha(const SpotRange& range, std::uint64_t seed) {
  return range.alpha(uniform(seed, 0, RandomStream::kRandomSpot));
}

Tissue random_tissue(const Config& config, std::uint64_t seed) {
  Tissue tissue = config.plant.tissue;
  std::uint64_t next = 1;
  for (const DeclaredQuantity& q : tissue_quantities(config.uncertainty, tissue)) {
    q.scale(tissue, 1.0 + draw(seed, next++, -q.less, q.more));
  }
  return tissue;
}

SpotOutcome treat_spot(const Config& config, const ReducedModel& model,
                       const std::shared_ptr<const FullOrderModel>& eye_model, double alpha,
                       double limit, std::uint64_t seed) {
  Config one = config;
  one.run.seed = seed;
  one.plant.absorption_factor = alpha;
  one.safety.supervised = false;
  const Treatment treatment = simulate_eye(one, model, {.full = eye_model});

  one.control.peak_max = limit;
  const RunSummaryNumbers numbers = summarize(one, treatment);
  const double held_mean = held(treatment, 0.05, 0.0).error;
  return {.alpha = alpha,
          .peak_max = numbers.peak_true_max,
          .violations = numbers.limit_violations,
          .time_to_95_percent = numbers.time_to_95_percent.value_or(config.run.duration),
          .held_mean = std::isnan(held_mean) ? 0.0 : held_mean,
          .rms_error = numbers.rms_error_after_50_ms.value_or(0.0),
          .absorption_error = *numbers.absorption_error_final};
}

// As a fraction of the whole.
auto reported(const Progress& progress, std::string_view stage, std::size_t count) {
  return [&progress, stage, count](std::size_t done) {
    if (progress) progress(stage, double(done) / double(count));
  };
}

// What [uncertainty] declares of the eye's tissue.
std::vector<DeclaredQuantity> corner_quantities(const Config& config) {
  std::vector<DeclaredQuantity> all = tissue_quantities(config.uncertainty, config.plant.tissue);
  std::erase_if(all, [](const DeclaredQuantity& q) { return !q.declared; });
  return all;
}

// The treatments of corner `index` up to number `count`.
void treat_corner(const Config& config, const ReducedModel& model, const SpotRange& range,
                  double limit, const CornerEffort& effort, std::size_t index, std::size_t count,
                  CornerOutcome& outcome) {
  Tissue tissue = config.plant.tissue;
  outcome.name.clear();
  for (const DeclaredQuantity& q : corner_quantities(config)) {
    const bool up = (index >> outcome.name.size() & 1) != 0;
    q.scale(tissue, 1.0 + q.change(up ? 1 : -1));
    outcome.name += up ? '+' : '-';
  }
  const auto eye = std::make_shared<const FullOrderModel>(tissue, config.grid);
  double held = outcome.held_mean * static_cast<double>(outcome.treatments);
  for (std::size_t& k = outcome.treatments; k < count; ++k) {
    const std::uint64_t seed = 1 + index * effort.count + k;
    const double alpha = k == 0   ? range.alpha_high
                         : k == 1 ? range.alpha_low
                                  : random_alpha(range, seed);
    const SpotOutcome one = treat_spot(config, model, eye, alpha, limit, seed);
    outcome.over += one.violations > 0 ? 1 : 0;
    held += one.held_mean;
    if (one.peak_max <= outcome.peak_max) continue;
    outcome.peak_max = one.peak_max;
    outcome.peak_max_alpha = alpha;
  }
  outcome.held_mean = held / static_cast<double>(outcome.treatments);
}

}  // namespace

std::vector<CornerOutcome> treat_corners(const Config& config, const ReducedModel& model,
                                         const SpotRange& range, double limit,
                                         const CornerEffort& effort, const Progress& progress) {
  static_cast<void>(Controller(model, config.control, config.estimator));
  std::vector<CornerOutcome> outcomes(std::size_t{1} << corner_quantities(config).size());
  for_each_in_parallel(
      outcomes.size(),
      [&](std::size_t i) {
        treat_corner(config, model, range, limit, effort, i, std::min(effort.survey, effort.count),
                     outcomes[i]);
      },
      reported(progress, "treating corners", outcomes.size()));
  std::vector<std::size_t> order(outcomes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return std::pair(outcomes[i].over, outcomes[i].peak_max) >
           std::pair(outcomes[j].over, outcomes[j].peak_max);
  });
  order.resize(std::min(order.size(), effort.worst));
  for_each_in_parallel(
      order.size(),
      [&](std::size_t i) {
        treat_corner(config, model, range, limit, effort, order[i], effort.count,
                     outcomes[order[i]]);
      },
      reported(progress, "treating the worst corners", order.size()));
  return outcomes;
}

std::vector<SpotOutcome> treat_spots(const Config& config, const ReducedModel& model,
                                     const SpotRange& range, double limit, std::size_t count,
                                     const Progress& progress) {
  // Settings that a controller refuses are refused here, not in a thread.
  static_cast<void>(Controller(model, config.control, config.estimator));
  const bool same_tissue = !config.uncertainty.declared();
  const auto shared = std::make_shared<const FullOrderModel>(config.plant.tissue, config.grid);
  std::vector<SpotOutcome> outcomes(count);
  for_each_in_parallel(
      count,
      [&](std::size_t i) {
        const std::uint64_t seed = i + 1;
        const auto eye = same_tissue ? shared
                                     : std::make_shared<const FullOrderModel>(
                                           random_tissue(config, seed), config.grid);
        outcomes[i] = treat_spot(config, model, eye, random_alpha(range, seed), limit, seed);
      },
      reported(progress, "treating spots", count));
  return outcomes;
}

}  // namespace photocoag
