#include "photocoag/campaign/spot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/campaign/standing_grid.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/run_folder.hpp"

namespace photocoag {
namespace {

BoundaryRange boundary_range(const Campaign& campaign) {
  Config low = campaign.config;
  Config high = campaign.config;
  std::vector<double> lows;
  std::vector<double> highs;
  for (const RandomQuantity& input : campaign.inputs) {
    lows.push_back(input.low);
    highs.push_back(input.high);
  }
  InputSetter(campaign, low).set(lows);
  InputSetter(campaign, high).set(highs);
  const Tissue& a = low.plant.tissue;
  const Tissue& b = high.plant.tissue;
  BoundaryRange range{.depth = b.depth(),
                      .spot_low = a.spot_radius,
                      .spot_high = b.spot_radius,
                      .domain_radius = campaign.config.plant.tissue.domain_radius};
  for (std::size_t i = 0; i < a.layers.size(); ++i) {
    range.peak_back += b.layers[i].thickness;
    if (a.layers[i].name == a.peak_layer) break;
    range.peak_front += a.layers[i].thickness;
  }
  return range;
}

// The last layer makes up for the others.
void stretch(Tissue& tissue, double depth) {
  double before = 0.0;
  for (std::size_t i = 0; i + 1 < tissue.layers.size(); ++i) before += tissue.layers[i].thickness;
  tissue.layers.back().thickness = depth - before;
}

bool is_of_tissue(const RandomQuantity& input) { return input.key.starts_with("plant.tissue."); }

}  // namespace

const std::vector<OutcomeColumn>& outcome_columns() {
  static const std::vector<OutcomeColumn> columns = {
      {"peak_max_K", "K", "highest true peak temperature rise"},
      {"overshoot_K", "K", "peak_max_K over the reference"},
      {"over_limit_K", "K", "peak_max_K over the limit; positive: the limit was exceeded"},
      {"over_limit_cycles", "1", "cycles with the true peak over the limit"},
      {"time_to_95_ms", "ms", "end of the first cycle at 95 % of the reference; NaN: never"},
      {"held_mean_error_K", "K", "mean of true peak minus reference after 50 ms; NaN: stopped"},
      {"held_std_K", "K", "standard deviation of the true peak after 50 ms; NaN: stopped"},
      {"absorption_error_percent", "%", "final estimate of the absorption factor over truth, - 1"},
      {"dose_schlott_2012", "1", "Arrhenius integral at the peak, visible lesion at 1"},
      {"dose_welch_polhamus", "1", "Arrhenius integral at the peak, damage at 1"},
      {"unsolved_cycles", "1", "cycles without an answer of the solver"},
      {"stopped", "1", "1: ended early by the supervisor"}};
  return columns;
}

std::size_t outcome_index(std::string_view name) {
  const auto& columns = outcome_columns();
  return static_cast<std::size_t>(
      std::find_if(columns.begin(), columns.end(),
                   [name](const OutcomeColumn& c) { return c.name == name; }) -
      columns.begin());
}

SpotModels make_spot_models(const Campaign& campaign, bool use_cache) {
  SpotModels models;
  ModelStore store(campaign.config, use_cache);
  models.controller = store.reduced();
  if (wants_margin(campaign.config)) {
    models.margin = tissue_margin(campaign.config, models.controller);
  }
  if (campaign.config.plant.model == PlantModel::kReduced) {
    for (const RandomQuantity& input : campaign.inputs) {
      if (!is_of_tissue(input)) continue;
      throw Error(ErrorParts{.where = campaign.file,
                             .key = "input.key",
                             .problem = "a reduced eye has one tissue",
                             .found = input.key,
                             .accepted = "plant.model = \"full\", or inputs outside plant.tissue"});
    }
    models.reduced_eye = std::make_unique<ReducedModel>(store.plant_reduced());
    return models;
  }
  for (const RandomQuantity& input : campaign.inputs) {
    if (input.key != "plant.tissue.domain_radius_um" &&
        input.key != "plant.tissue.layers." + campaign.config.plant.tissue.layers.back().name +
                         ".thickness_um") {
      continue;
    }
    throw Error(ErrorParts{.where = campaign.file,
                           .key = "input.key",
                           .problem = "the outer dimensions are the same for all spots",
                           .found = input.key,
                           .accepted = "another key; the last layer makes up for the others"});
  }
  const BoundaryRange range = boundary_range(campaign);
  Tissue tissue = campaign.config.plant.tissue;
  stretch(tissue, range.depth);
  models.depth = range.depth;
  models.standing = std::make_shared<const FullOrderModel>(
      tissue, make_standing_grid(range, campaign.config.grid.min_cells));
  FullOrderModel(*models.standing, tissue);  // refuses what a standing grid cannot serve
  return models;
}

SpotRunner::SpotRunner(const Campaign& campaign, const SpotModels& models)
    : campaign_(campaign), models_(models), config_(campaign.config), setter_(campaign, config_) {}

SpotRecord SpotRunner::run(std::uint64_t spot) {
  SpotRecord record{.spot = spot,
                    .noise_seed = noise_seed(campaign_, spot),
                    .inputs = draw_inputs(campaign_, spot),
                    .outcomes = {}};
  setter_.set(record.inputs);
  config_.run.seed = record.noise_seed;
  config_.plant.tissue_differs = !(config_.plant.tissue == config_.tissue);
  EyeModel eye{.full = nullptr, .reduced = models_.reduced_eye.get()};
  if (models_.standing) {
    Tissue tissue = config_.plant.tissue;
    stretch(tissue, models_.depth);
    eye.full = std::make_shared<const FullOrderModel>(*models_.standing, tissue);
  }
  // Backed off or not, the outcomes are those against the reference and the limit asked for.
  const Config& believed = models_.margin ? backed_off(config_, *models_.margin) : config_;
  treatment_ = simulate_eye(believed, models_.controller, eye,
                            {.sensor_gain = setter_.calibration_factor(),
                             .sensor_offset = setter_.calibration_offset(),
                             .delay = setter_.delay(),
                             .first_power = std::nullopt,
                             .self_test = false});

  const RunSummaryNumbers numbers = summarize(config_, treatment_);
  const bool stopped = treatment_.outcome.stopped;
  const double reference = config_.control.peak_reference;
  double late = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  double unsolved = 0.0;
  for (const CycleRecord& cycle : treatment_.records) {
    unsolved += cycle.decision.status == MpcStatus::kFailed ? 1.0 : 0.0;
    if (cycle.time <= 0.05 || stopped) continue;
    const double error = cycle.truth.peak - reference;
    late += 1.0;
    sum += error;
    squares += error * error;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double mean = late > 0.0 ? sum / late : nan;
  record.outcomes = {numbers.peak_true_max,
                     numbers.peak_true_max - reference,
                     numbers.peak_true_max - numbers.limit,
                     static_cast<double>(numbers.limit_violations),
                     numbers.time_to_95_percent ? *numbers.time_to_95_percent * 1e3 : nan,
                     mean,
                     late > 0.0 ? std::sqrt(std::max(0.0, squares / late - mean * mean)) : nan,
                     100.0 * numbers.absorption_error_final.value_or(0.0),
                     numbers.thermal_dose[0],
                     numbers.thermal_dose[1],
                     unsolved,
                     stopped ? 1.0 : 0.0};
  return record;
}

}  // namespace photocoag
