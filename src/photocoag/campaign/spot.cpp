#include "photocoag/campaign/spot.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/shared_grid.hpp"
#include "photocoag/population/eye_models.hpp"
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

// The last layer absorbs the differences in depth.
void stretch(Tissue& tissue, double depth) {
  double before = 0.0;
  for (std::size_t i = 0; i + 1 < tissue.layers.size(); ++i) before += tissue.layers[i].thickness;
  tissue.layers.back().thickness = depth - before;
}

// A step's cost grows with the number of earlier steps: beyond about 20,000 cycles a ModalStepper
// is faster.
constexpr std::size_t kSampledCycles = 10'000;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Of the estimated peak and its stated deviation, over the cycles from some time on.
struct Consistency {
  double nees = kNone;     ///< mean of error^2 / variance
  double covered = kNone;  ///< share of the cycles within 1.96 deviations
};

Consistency consistency(const Treatment& treatment, double from) {
  constexpr double kWithin = 1.96 * 1.96;  // 95 % of a normal distribution
  constexpr double kRounding = 1e-9;       // s: 5 * 0.001 is not quite 0.005
  double count = 0.0;
  double sum = 0.0;
  double within = 0.0;
  for (const CycleRecord& cycle : treatment.records) {
    const double sigma = cycle.estimate.peak_sigma;
    if (cycle.time < from - kRounding || !(sigma > 0.0)) continue;
    const double score = (cycle.estimate.outputs.peak - cycle.truth.peak) / sigma;
    count += 1.0;
    sum += score * score;
    within += score * score <= kWithin ? 1.0 : 0.0;
  }
  if (count == 0.0) return {};
  return {sum / count, within / count};
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
      {"stopped", "1", "1: ended early by the supervisor"},
      {"reached_95_percent", "1", "1: the true peak got to 95 % of the reference"},
      {"held_half_error_K", "K",
       "mean of true peak minus reference over the second half; NaN: stopped"},
      {"estimate_error_rms_K", "K",
       "of estimated minus true peak over the second half; NaN: stopped"},
      {"peak_nees", "1",
       "mean of (estimated minus true peak)^2 over the estimate's variance from 5 ms on"},
      {"peak_covered_95", "1",
       "share of the cycles from 5 ms on with the true peak within 1.96 deviations of the "
       "estimate"},
      {"prior_probability", "1",
       "smaller one of the two tests of the prior; NaN: no posterior estimator"}};
  return columns;
}

std::size_t outcome_index(std::string_view name) {
  const auto& columns = outcome_columns();
  return static_cast<std::size_t>(
      std::find_if(columns.begin(), columns.end(),
                   [name](const OutcomeColumn& c) { return c.name == name; }) -
      columns.begin());
}

std::size_t block_size(std::size_t inputs) { return 2 + inputs + outcome_columns().size(); }

std::vector<double> to_block(const SpotRecord& record) {
  std::vector<double> block = {std::bit_cast<double>(record.spot),
                               std::bit_cast<double>(record.noise_seed)};
  block.insert(block.end(), record.inputs.begin(), record.inputs.end());
  block.insert(block.end(), record.outcomes.begin(), record.outcomes.end());
  return block;
}

SpotRecord from_block(const double* block, std::size_t inputs) {
  const double* values = block + 2;
  return {.spot = std::bit_cast<std::uint64_t>(block[0]),
          .noise_seed = std::bit_cast<std::uint64_t>(block[1]),
          .inputs = {values, values + inputs},
          .outcomes = {values + inputs, block + block_size(inputs)}};
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
      tissue, make_shared_grid(range, campaign.config.grid.min_cells));
  FullOrderModel(*models.standing, tissue);  // refuses what a shared grid does not support
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
    eye.sampled = config_.cycles() <= kSampledCycles;
  }
  // Outcomes are relative to the configured reference and limit, whether backed off or not.
  const Config& believed = models_.margin ? backed_off(config_, *models_.margin) : config_;
  treatment_ = simulate_eye(believed, models_.controller, eye,
                            {.sensor_gain = setter_.calibration_factor(),
                             .sensor_offset = setter_.calibration_offset(),
                             .delay = setter_.delay(),
                             .self_test = false});

  const RunSummaryNumbers numbers = summarize(config_, treatment_);
  const double reference = config_.control.peak_reference;
  const Held late = held(treatment_, 0.05, reference);
  const Held half = held(treatment_, 0.5 * config_.run.duration, reference);
  const Consistency peak = consistency(treatment_, 0.005);
  double unsolved = 0.0;
  for (const CycleRecord& cycle : treatment_.records) {
    unsolved += cycle.decision.status == MpcStatus::kFailed ? 1.0 : 0.0;
  }
  record.outcomes = {numbers.peak_true_max,
                     numbers.peak_true_max - reference,
                     numbers.peak_true_max - numbers.limit,
                     static_cast<double>(numbers.limit_violations),
                     numbers.time_to_95_percent ? *numbers.time_to_95_percent * 1e3 : kNone,
                     late.error,
                     late.deviation,
                     100.0 * numbers.absorption_error_final.value_or(0.0),
                     numbers.thermal_dose[0],
                     numbers.thermal_dose[1],
                     unsolved,
                     treatment_.outcome.stopped ? 1.0 : 0.0,
                     numbers.time_to_95_percent ? 1.0 : 0.0,
                     half.error,
                     half.estimate_rms,
                     peak.nees,
                     peak.covered,
                     treatment_.prior_check ? treatment_.prior_check->probability() : kNone};
  return record;
}

}  // namespace photocoag
