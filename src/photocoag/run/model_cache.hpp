// Role: setup; full-order and reduced models for a configuration, the reduced one cached. Used by
// run, population, campaign, python, apps.
#pragma once

#include <memory>
#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Where reduced models are kept: $XDG_CACHE_HOME/photocoag, else ~/.cache/photocoag; empty if
/// neither is known.
std::string cache_folder();

/// Models of one configuration, built when first asked for.
class ModelStore {
 public:
  /// `use_cache`: read and write the cache folder. The models do not depend on it.
  ModelStore(const Config& config, bool use_cache, Progress progress = {});

  /// The full-order model of [tissue] (what the controller's model is made from).
  std::shared_ptr<const FullOrderModel> model_full();
  /// The full-order model of the simulated eye: [tissue] with [plant.tissue].
  std::shared_ptr<const FullOrderModel> plant_full();
  /// The controller's reduced model: model.file, or reduced now, or from the cache. Throws Error if
  /// model.file does not fit the configuration (period, discretization, tissue), or if the model,
  /// whatever its source, does not respond as the tissue does (check_model).
  const ReducedModel& reduced();
  /// A reduced model of the simulated eye for plant.model = "reduced", with the plant's
  /// discretization.
  ReducedModel plant_reduced();
  const Config& config() const noexcept { return config_; }

 private:
  std::shared_ptr<const FullOrderModel> make_full(const Tissue& tissue) const;
  ReducedModel load() const;
  /// `belief`: quantities that the model also carries; null: none.
  ReducedModel make(const Tissue& tissue, Discretization discretization,
                    std::shared_ptr<const FullOrderModel> (ModelStore::*full)(),
                    const Belief* belief);
  bool uncertain() const noexcept;

  const Config config_;
  bool use_cache_;
  Progress progress_;
  std::shared_ptr<const FullOrderModel> model_full_;
  std::shared_ptr<const FullOrderModel> plant_full_;
  std::unique_ptr<ReducedModel> reduced_;
};

}  // namespace photocoag
