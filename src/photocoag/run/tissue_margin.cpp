#include "photocoag/run/tissue_margin.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kCells = 20000;
constexpr double kSmallestFactor = 0.5;

// One declared quantity: which part of the tissue it scales, and by how much at most.
struct Quantity {
  std::string name;
  double relative;
  enum class Part { kSpotRadius, kThickness, kAbsorption } part;
  std::size_t layer = 0;
};

std::vector<Quantity> quantities_of(const Config& config) {
  const UncertaintySettings& u = config.uncertainty;
  std::vector<Quantity> all;
  if (u.spot_radius > 0.0) {
    all.push_back({"spot radius", u.spot_radius, Quantity::Part::kSpotRadius});
  }
  for (std::size_t i = 0; i < config.tissue.layers.size(); ++i) {
    const Layer& layer = config.tissue.layers[i];
    if (u.thickness > 0.0) {
      all.push_back({layer.name + " thickness", u.thickness, Quantity::Part::kThickness, i});
    }
    if (u.absorption > 0.0 && !layer.scaled_by_alpha && layer.absorption > 0.0) {
      all.push_back({layer.name + " absorption", u.absorption, Quantity::Part::kAbsorption, i});
    }
  }
  return all;
}

void change(Tissue& tissue, const Quantity& quantity, int direction) {
  const double factor = 1.0 + direction * quantity.relative;
  switch (quantity.part) {
    case Quantity::Part::kSpotRadius:
      tissue.spot_radius *= factor;
      for (double& radius : tissue.beam_radii) radius *= factor;
      break;
    case Quantity::Part::kThickness:
      tissue.layers[quantity.layer].thickness *= factor;
      break;
    case Quantity::Part::kAbsorption:
      tissue.layers[quantity.layer].absorption *= factor;
      break;
  }
}

// The highest true peak of a treatment, with the filter's deviations at that moment on top.
double highest_peak(const Config& config, const ReducedModel& model,
                    const std::shared_ptr<const FullOrderModel>& eye_model, double alpha) {
  Config quiet = config;
  quiet.plant.absorption_factor = alpha;
  quiet.plant.choroid_factor = config.estimator.choroid_initial;
  quiet.plant.noise = 0.0;
  quiet.plant.zero_power_sample = ZeroPowerSample::kMeasured;
  quiet.safety.supervised = false;
  const Treatment treatment = simulate_eye(quiet, model, {.full = eye_model});
  double highest = 0.0;
  for (const CycleRecord& record : treatment.records) {
    // Before the first sample the deviation is that of alpha's initial value, not of this eye.
    const double sigma = record.cycle == 0 ? 0.0 : record.estimate.peak_sigma;
    highest = std::max(highest, record.truth.peak + config.control.robust_sigma * sigma);
  }
  return highest;
}

std::shared_ptr<const FullOrderModel> eye_of(const Tissue& tissue) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = kCells});
}

}  // namespace

Config backed_off(const Config& config, const TissueMargin& margin) {
  Config result = config;
  result.control.peak_reference *= margin.factor;
  result.control.peak_max *= margin.factor;
  for (double& value : result.control.reference_values) value *= margin.factor;
  return result;
}

TissueMargin tissue_margin(const Config& config, const ReducedModel& model) {
  const EstimatorSettings& e = config.estimator;
  const std::array alphas{
      std::max(e.absorption_min, e.absorption_initial - 1.5 * e.absorption_sigma_initial),
      e.absorption_initial,
      std::min(e.absorption_max, e.absorption_initial + 3.0 * e.absorption_sigma_initial)};
  TissueMargin margin;
  Tissue worst = config.tissue;
  std::string changes;
  for (const Quantity& quantity : quantities_of(config)) {
    std::array<double, 2> peaks{};
    for (const int side : {0, 1}) {
      Tissue tissue = config.tissue;
      change(tissue, quantity, side == 0 ? -1 : 1);
      peaks[side] = highest_peak(config, model, eye_of(tissue), e.absorption_initial);
    }
    const int direction = peaks[1] > peaks[0] ? 1 : -1;
    change(worst, quantity, direction);
    changes += fmt::format("{} {:+g} %, ", quantity.name, direction * 100.0 * quantity.relative);
  }
  const auto eye = eye_of(worst);
  const auto worst_peak = [&](const Config& tried) {
    double highest = 0.0;
    for (const double alpha : alphas) {
      const double peak = highest_peak(tried, model, eye, alpha);
      if (peak <= highest) continue;
      highest = peak;
      margin.worst = fmt::format("{}alpha {:.3g}", changes, alpha);
    }
    return highest;
  };
  margin.peak_protected = margin.peak_unprotected = worst_peak(config);
  // The peak falls nearly in proportion: two or three rounds.
  while (margin.peak_protected > config.control.peak_max) {
    margin.factor *= 0.999 * config.control.peak_max / margin.peak_protected;
    if (margin.factor < kSmallestFactor) {
      throw Error(ErrorParts{
          .key = "uncertainty",
          .problem = "no reference from half of control.peak_reference_K on keeps the limit",
          .found =
              fmt::format("a highest peak of {:.2f} K for {}", margin.peak_protected, margin.worst),
          .accepted =
              "smaller uncertainties, control.robust = \"certified\", or a shorter period"});
    }
    margin.peak_protected = worst_peak(backed_off(config, margin));
  }
  return margin;
}

}  // namespace photocoag
