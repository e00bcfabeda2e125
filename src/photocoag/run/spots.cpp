#include "photocoag/run/spots.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "photocoag/core/parallel.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {
namespace {

// Number i of spot `seed`, uniform over [low, high].
double draw(std::uint64_t seed, std::uint64_t i, double low, double high) {
  return low + (high - low) * uniform(seed, i, RandomStream::kRandomSpot);
}

Tissue random_tissue(const Config& config, std::uint64_t seed) {
  const UncertaintySettings& u = config.uncertainty;
  Tissue tissue = config.plant.tissue;
  std::uint64_t next = 1;
  const auto factor = [&](double relative) {
    return 1.0 + draw(seed, next++, -relative, relative);
  };
  const double wider = factor(u.spot_radius);
  tissue.spot_radius *= wider;
  for (double& beam : tissue.beam_radii) beam *= wider;
  for (Layer& layer : tissue.layers) {
    layer.thickness *= factor(u.thickness);
    if (layer.scaled_by != ScaledBy::kAlpha) layer.absorption *= factor(u.absorption);
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

  const double reference = config.control.peak_reference;
  SpotOutcome outcome{.alpha = alpha};
  std::optional<double> first_reached;
  double sum = 0.0;
  double squares = 0.0;
  std::size_t late = 0;
  for (const CycleRecord& record : treatment.records) {
    const double peak = record.truth.peak;
    outcome.peak_max = std::max(outcome.peak_max, peak);
    outcome.violations += peak > limit ? 1 : 0;
    if (!first_reached && reached(peak, reference)) first_reached = record.time;
    if (record.time <= 0.05) continue;
    sum += peak;
    squares += (peak - reference) * (peak - reference);
    ++late;
  }
  if (late > 0) {
    outcome.held_mean = sum / static_cast<double>(late);
    outcome.rms_error = std::sqrt(squares / static_cast<double>(late));
  }
  outcome.time_to_95_percent = first_reached.value_or(config.run.duration);
  outcome.absorption_error = treatment.records.back().estimate.absorption_factor / alpha - 1.0;
  return outcome;
}

// As a fraction of the whole.
auto told(const Progress& progress, std::string_view stage, std::size_t count) {
  return [&progress, stage, count](std::size_t done) {
    if (progress) progress(stage, double(done) / double(count));
  };
}

// The value that the next bit of `corner` says, and its sign appended to `name`.
double pushed(double value, double relative, std::size_t& corner, std::string& name) {
  if (relative == 0.0) return value;
  const bool up = (corner & 1) != 0;
  corner >>= 1;
  name += up ? '+' : '-';
  return value * (up ? 1.0 + relative : 1.0 - relative);
}

// Bits of `corner` that are left mean that there are no more corners.
Tissue corner_tissue(const Config& config, std::size_t& corner, std::string& name) {
  const UncertaintySettings& u = config.uncertainty;
  Tissue tissue = config.plant.tissue;
  const double radius = tissue.spot_radius;
  tissue.spot_radius = pushed(radius, u.spot_radius, corner, name);
  for (double& beam : tissue.beam_radii) beam *= tissue.spot_radius / radius;
  for (Layer& layer : tissue.layers) {
    layer.thickness = pushed(layer.thickness, u.thickness, corner, name);
    if (layer.scaled_by == ScaledBy::kAlpha || layer.absorption == 0.0) continue;
    layer.absorption = pushed(layer.absorption, u.absorption, corner, name);
  }
  return tissue;
}

std::size_t count_corners(const Config& config) {
  std::string name;
  std::size_t none = 0;
  corner_tissue(config, none, name);
  return std::size_t{1} << name.size();
}

// The treatments of corner `index` up to number `count`.
void attack_corner(const Config& config, const ReducedModel& model, const SpotRange& range,
                   double limit, const CornerAttack& attack, std::size_t index, std::size_t count,
                   CornerOutcome& outcome) {
  std::size_t corner = index;
  outcome.name.clear();
  const auto eye = std::make_shared<const FullOrderModel>(
      corner_tissue(config, corner, outcome.name), config.grid);
  double held = outcome.held_mean * static_cast<double>(outcome.treatments);
  for (std::size_t& k = outcome.treatments; k < count; ++k) {
    const std::uint64_t seed = 1 + index * attack.count + k;
    const double alpha = k == 0   ? range.alpha_high
                         : k == 1 ? range.alpha_low
                                  : draw(seed, 0, range.alpha_low, range.alpha_high);
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

std::vector<CornerOutcome> attack_corners(const Config& config, const ReducedModel& model,
                                          const SpotRange& range, double limit,
                                          const CornerAttack& attack, const Progress& progress) {
  static_cast<void>(Controller(model, config.control, config.estimator));
  std::vector<CornerOutcome> outcomes(count_corners(config));
  for_each_in_parallel(
      outcomes.size(),
      [&](std::size_t i) {
        attack_corner(config, model, range, limit, attack, i, std::min(attack.survey, attack.count),
                      outcomes[i]);
      },
      told(progress, "treating corners", outcomes.size()));
  std::vector<std::size_t> order(outcomes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return std::pair(outcomes[i].over, outcomes[i].peak_max) >
           std::pair(outcomes[j].over, outcomes[j].peak_max);
  });
  order.resize(std::min(order.size(), attack.worst));
  for_each_in_parallel(
      order.size(),
      [&](std::size_t i) {
        attack_corner(config, model, range, limit, attack, order[i], attack.count,
                      outcomes[order[i]]);
      },
      told(progress, "treating the worst corners", order.size()));
  return outcomes;
}

std::vector<SpotOutcome> treat_spots(const Config& config, const ReducedModel& model,
                                     const SpotRange& range, double limit, std::size_t count,
                                     const Progress& progress) {
  // What a controller refuses is refused here, not in a thread.
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
        outcomes[i] = treat_spot(config, model, eye,
                                 draw(seed, 0, range.alpha_low, range.alpha_high), limit, seed);
      },
      told(progress, "treating spots", count));
  return outcomes;
}

}  // namespace photocoag
