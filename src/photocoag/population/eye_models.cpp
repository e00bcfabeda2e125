#include "photocoag/population/eye_models.hpp"

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

}  // namespace photocoag
