#include "photocoag/population/eye_models.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/run/model_cache.hpp"

namespace photocoag {

EyeModels make_eye_models(const Config& config, bool use_cache) {
  ModelStore store(config, use_cache);
  EyeModels models{.reduced = store.reduced(), .full = nullptr, .plant = {}};
  if (config.plant.model == PlantModel::kFull) {
    models.full = store.plant_full();
  } else {
    models.plant = store.plant_reduced();
  }
  return models;
}

Treatment treat_eye(const Config& config, const ReducedModel& model, const EyeModel& eye) {
  PlantMismatch options;
  options.self_test = false;
  return simulate_eye(config, model, eye, options);
}

Held held(const Treatment& treatment, double after, double reference) {
  if (treatment.outcome.stopped) return {};
  double count = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  double estimate_squares = 0.0;
  for (const CycleRecord& cycle : treatment.records) {
    if (cycle.time <= after) continue;
    const double error = cycle.truth.peak - reference;
    const double of_estimate = cycle.estimate.outputs.peak - cycle.truth.peak;
    count += 1.0;
    sum += error;
    squares += error * error;
    estimate_squares += of_estimate * of_estimate;
  }
  if (count == 0.0) return {};
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean)),
          std::sqrt(estimate_squares / count)};
}

}  // namespace photocoag
