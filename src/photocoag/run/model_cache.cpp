#include "photocoag/run/model_cache.hpp"

#include <fmt/format.h>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/mor/uncertain_fit.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/run/kept_modes.hpp"
#include "photocoag/run/tissue_reference.hpp"

namespace photocoag {
namespace {

// Everything a reduced model depends on, with the code version; numbers in full precision.
std::string cache_key(const Tissue& tissue, const GridSettings& grid,
                      const ReductionSettings& reduction, double period,
                      Discretization discretization, const Belief* belief) {
  std::string text =
      fmt::format("{} {} {} {} {} {} {} {} {:a} {} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {} {}",
                  source_hash(), kModelFileVersion, grid.min_cells, to_string(reduction.method),
                  to_string(reduction.refinement), reduction.order,
                  to_string(reduction.dependence()), reduction.terms(tissue.two_parameters()),
                  period, to_string(discretization), tissue.ambient_celsius, tissue.domain_radius,
                  tissue.spot_radius, tissue.transmission, tissue.density, tissue.heat_capacity,
                  tissue.conductivity, to_string(tissue.volume_temperature), tissue.peak_layer);
  text += fmt::format(" {}", to_string(tissue.beam));
  for (std::size_t i = 0; i < tissue.beam_radii.size(); ++i) {
    text += fmt::format(" {:a} {:a}", tissue.beam_radii[i], tissue.beam_intensities[i]);
  }
  const auto optional = [](const std::optional<double>& value) {
    return value ? fmt::format("{:a}", *value) : std::string("-");
  };
  for (const Layer& layer : tissue.layers) {
    text += fmt::format("\n{} {:a} {:a} {} {} {} {} {:a}", layer.name, layer.thickness,
                        layer.absorption, layer.scaled_by == ScaledBy::kAlpha,
                        optional(layer.conductivity), optional(layer.density),
                        optional(layer.heat_capacity), layer.perfusion);
    if (layer.scaled_by == ScaledBy::kBeta) {
      text += fmt::format(" beta {:a} {:a}", reduction.choroid_min, reduction.choroid_max);
    }
  }
  if (belief != nullptr) {
    for (const UncertainQuantity& q : belief->quantities) {
      text += fmt::format("\n{} {} {:a} {:a} {}", to_string(q.kind), q.layer, q.low, q.high,
                          q.estimated);
    }
  }
  return sha256_hex(text).substr(0, 32);
}

/// Properties that a cached model must have, whatever its file's name.
struct Wanted {
  const Tissue& tissue;
  const ReductionSettings& reduction;
  double period;
  Discretization discretization;
  const Belief* belief;  ///< null: nothing is uncertain

  void check(const ReducedModel& model, const EstimatorSettings& estimator) const {
    if (!(model.tissue == tissue && model.period == period &&
          model.discretization == discretization && model.order() <= reduction.order &&
          (belief == nullptr ||
           (model.uncertain && model.uncertain->quantities == belief->quantities)))) {
      throw Error("another model than the file's name says");
    }
    check_model(model, tissue, estimator, "");
  }
};

std::optional<ReducedModel> read_cached(const std::string& path, const Wanted& wanted,
                                        const EstimatorSettings& estimator) {
  if (path.empty() || !std::filesystem::exists(path)) return std::nullopt;
  try {
    ReducedModel model = load_reduced_model(path);
    wanted.check(model, estimator);
    return model;
  } catch (const Error&) {
    return std::nullopt;  // damaged or another model: made again, and the file replaced
  }
}

void write_cached(const std::string& path, const ReducedModel& model) {
  if (path.empty()) return;
  try {
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    // Replace links and pipes too: the folder belongs to the cache.
    const std::filesystem::file_status there = std::filesystem::symlink_status(path);
    if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
      std::filesystem::remove(path);
    }
    save_reduced_model(model, path);
  } catch (const std::exception&) {
    // A cache that cannot be written only costs half a second at the next start.
  }
}

std::string thermal_difference(const Layer& config, const Layer& model) {
  const std::pair<std::string_view, std::optional<double> Layer::*> numbers[] = {
      {"conductivity_W_per_mK", &Layer::conductivity},
      {"density_kg_per_m3", &Layer::density},
      {"heat_capacity_J_per_kgK", &Layer::heat_capacity}};
  const auto shown = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.10g}", *value) : std::string("the tissue's");
  };
  for (const auto& [key, member] : numbers) {
    if (config.*member == model.*member) continue;
    return fmt::format("{} = {}, model with {}", key, shown(config.*member), shown(model.*member));
  }
  if (config.perfusion == model.perfusion) return {};
  return fmt::format("perfusion_W_per_m3K = {:.10g}, model with {:.10g}", config.perfusion,
                     model.perfusion);
}

// The first key of [tissue] in which a configuration and a model disagree.
std::string first_difference(const Tissue& config, const Tissue& model) {
  const auto differ = [](std::string_view key, double in_config, double in_model) {
    return fmt::format("{} = {:.10g}, model with {:.10g}", key, in_config, in_model);
  };
  const std::pair<std::string_view, double Tissue::*> numbers[] = {
      {"ambient_C", &Tissue::ambient_celsius},
      {"domain_radius (m)", &Tissue::domain_radius},
      {"spot_radius (m)", &Tissue::spot_radius},
      {"transmission", &Tissue::transmission},
      {"density_kg_per_m3", &Tissue::density},
      {"heat_capacity_J_per_kgK", &Tissue::heat_capacity},
      {"conductivity_W_per_mK", &Tissue::conductivity}};
  for (const auto& [key, member] : numbers) {
    if (config.*member != model.*member) return differ(key, config.*member, model.*member);
  }
  if (config.volume_temperature != model.volume_temperature) {
    return fmt::format("volume_temperature = \"{}\", model with \"{}\"",
                       to_string(config.volume_temperature), to_string(model.volume_temperature));
  }
  if (config.beam != model.beam) {
    return fmt::format("beam = \"{}\", model with \"{}\"", to_string(config.beam),
                       to_string(model.beam));
  }
  if (config.beam_radii != model.beam_radii) return "other values of beam_radius_um";
  if (config.beam_intensities != model.beam_intensities) return "other values of beam_intensity";
  for (std::size_t i = 0; i < std::min(config.layers.size(), model.layers.size()); ++i) {
    const Layer& mine = config.layers[i];
    const Layer& theirs = model.layers[i];
    if (mine.name != theirs.name) {
      return fmt::format("layer {} named {}, model with {}", i + 1, mine.name, theirs.name);
    }
    if (mine.thickness != theirs.thickness) {
      return differ(mine.name + " thickness (m)", mine.thickness, theirs.thickness);
    }
    if (mine.absorption != theirs.absorption) {
      return differ(mine.name + " absorption_per_m", mine.absorption, theirs.absorption);
    }
    if (mine.scaled_by != theirs.scaled_by) {
      return fmt::format("{} scaled_by = \"{}\", model with \"{}\"", mine.name,
                         to_string(mine.scaled_by), to_string(theirs.scaled_by));
    }
    const std::string thermal = thermal_difference(mine, theirs);
    if (!thermal.empty()) return mine.name + " " + thermal;
  }
  return "other layers or another peak_layer";
}

void check_fits(const ReducedModel& model, const Config& config) {
  const std::string& file = config.model.file;
  if (std::abs(model.period - config.control.period) > 1e-9 * config.control.period) {
    throw Error(ErrorParts{.where = file,
                           .key = "control.period_ms",
                           .problem = "the model is for another control period",
                           .found = fmt::format("{:g} ms, model for {:g} ms",
                                                config.control.period * 1e3, model.period * 1e3),
                           .accepted =
                               "the model's period, or a model made with the same configuration by "
                               "`photocoag reduce`"});
  }
  if (model.discretization != config.model.discretization) {
    throw Error(ErrorParts{
        .where = file,
        .key = "model.discretization",
        .problem = "the model is discretized another way",
        .found = fmt::format("\"{}\", model with \"{}\"", to_string(config.model.discretization),
                             to_string(model.discretization)),
        .accepted = "the model's discretization, or a model made for this one"});
  }
  const double initial = config.estimator.absorption_initial;
  const ParameterRange& alpha = model.parameters[0];
  if (!(initial >= alpha.min && initial <= alpha.max)) {
    throw Error(ErrorParts{
        .where = file,
        .key = "estimator.absorption_initial",
        .problem = "outside the absorption factors that the model is made for",
        .found = fmt::format("{:g}", initial),
        .accepted = fmt::format("from {:g} to {:g}, or another model", alpha.min, alpha.max)});
  }
  if (!(model.tissue == config.tissue)) {
    throw Error(ErrorParts{
        .where = file,
        .key = "tissue",
        .problem = "the model was made from another tissue than [tissue]",
        .found = first_difference(config.tissue, model.tissue),
        .accepted = "the [tissue] that the model was made from; an eye that differs goes into "
                    "[plant.tissue]"});
  }
}

}  // namespace

std::string cache_folder() {
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder != nullptr && *folder != '\0') {
    return std::string(folder) + "/photocoag";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return std::string(home) + "/.cache/photocoag";
  }
  return {};
}

ModelStore::ModelStore(const Config& config, bool use_cache, Progress progress)
    : config_(config), use_cache_(use_cache), progress_(std::move(progress)) {}

std::shared_ptr<const FullOrderModel> ModelStore::make_full(const Tissue& tissue) const {
  const Diagonalize how = kept_modes(use_cache_ ? cache_folder() : std::string());
  const DiagonalizeWith chosen(how);
  return std::make_shared<const FullOrderModel>(tissue, config_.grid);
}

std::shared_ptr<const FullOrderModel> ModelStore::model_full() {
  if (!model_full_) model_full_ = make_full(config_.tissue);
  return model_full_;
}

std::shared_ptr<const FullOrderModel> ModelStore::plant_full() {
  if (config_.plant.tissue == config_.tissue) return model_full();
  if (!plant_full_) {
    plant_full_ = make_full(config_.plant.tissue);
  }
  return plant_full_;
}

ReducedModel ModelStore::make(const Tissue& tissue, Discretization discretization,
                              std::shared_ptr<const FullOrderModel> (ModelStore::*full)(),
                              const Belief* belief) {
  const std::string folder = use_cache_ ? cache_folder() : std::string();
  const std::string path =
      folder.empty() ? std::string()
                     : fmt::format("{}/model-{}.json", folder,
                                   cache_key(tissue, config_.grid, config_.model.reduction,
                                             config_.control.period, discretization, belief));
  const Wanted wanted{tissue, config_.model.reduction, config_.control.period, discretization,
                      belief};
  if (auto cached = read_cached(path, wanted, config_.estimator)) return *std::move(cached);
  ReducedModel model = reduce((this->*full)(), config_.model.reduction, config_.control.period,
                              discretization, progress_);
  if (belief != nullptr) {
    if (progress_) progress_("fitting the uncertain quantities", 1.0);
    model.uncertain = std::make_shared<const UncertainModel>(
        fit_uncertain_model(tissue, config_.grid, *belief, config_.control.period));
  }
  write_cached(path, model);
  return model;
}

bool ModelStore::uncertain() const noexcept {
  return config_.estimator.kind == EstimatorKind::kPosterior;
}

ReducedModel ModelStore::load() const {
  try {
    return load_reduced_model(config_.model.file);
  } catch (const Error& error) {
    ErrorParts parts = error.parts();
    parts.key = parts.key.empty() ? "model.file" : "model.file: " + parts.key;
    throw Error(std::move(parts));
  }
}

const ReducedModel& ModelStore::reduced() {
  if (reduced_) return *reduced_;
  const std::string& file = config_.model.file;
  ReducedModel model =
      file.empty() ? make(config_.tissue, config_.model.discretization, &ModelStore::model_full,
                          uncertain() ? &config_.estimator.prior : nullptr)
                   : load();
  if (!file.empty()) check_fits(model, config_);
  check_model(model, config_.tissue, config_.estimator, file);
  reduced_ = std::make_unique<ReducedModel>(std::move(model));
  return *reduced_;
}

ReducedModel ModelStore::plant_reduced() {
  if (config_.plant.tissue == config_.tissue && config_.model.file.empty() &&
      config_.plant.discretization == config_.model.discretization) {
    return reduced();
  }
  return make(config_.plant.tissue, config_.plant.discretization, &ModelStore::plant_full, nullptr);
}

}  // namespace photocoag
