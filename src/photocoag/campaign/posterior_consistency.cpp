#include "photocoag/campaign/posterior_consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <tuple>

#include "photocoag/campaign/batch_estimate.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/mpc/chance.hpp"
#include "photocoag/population/statistics.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kBatchEvery = 5;  // cycles of the second half
constexpr double kWithin = 1.96;
constexpr double kProbabilities[] = {0.1, 0.01, 0.001, 0.0001};

struct Eye {
  double alpha = 0.0;
  std::vector<double> error;        // K, of the estimated peak
  std::vector<double> sigma;        // K, as stated
  std::vector<double> batch_error;  // K; NaN: none
  double relative_error = 0.0;      // ln(truth / batch estimate) of the last peak
  double relative_sigma = 0.0;
};

bool has_batch(std::size_t cycle, std::size_t cycles) {
  return 2 * cycle >= cycles && ((cycles - 1 - cycle) % kBatchEvery) == 0;
}

Eye look_at(SpotRunner& runner, const UncertainModel& model, std::uint64_t spot) {
  runner.run(spot);
  const Config& config = runner.config();
  const Treatment& treatment = runner.treatment();
  const std::size_t cycles = config.cycles();
  if (treatment.records.size() < cycles) {
    throw Error(ErrorParts{.where = "spot " + std::to_string(spot),
                           .problem = "the supervisor stopped the treatment",
                           .accepted = "a campaign whose treatments run to their end, e.g. with "
                                       "safety.supervisor=off"});
  }
  Eye eye;
  eye.alpha = config.plant.absorption_factor;
  std::vector<SampledCycle> record;
  for (const CycleRecord& cycle : treatment.records) {
    record.push_back({cycle.power, cycle.measured});
    eye.error.push_back(cycle.estimate.outputs.peak - cycle.truth.peak);
    eye.sigma.push_back(cycle.estimate.peak_sigma);
  }
  eye.batch_error.assign(cycles, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 0; k < cycles; ++k) {
    if (!has_batch(k, cycles)) continue;
    const double truth = treatment.records[k].truth.peak;
    const BatchEstimate batch =
        batch_estimate(model, config.estimator.prior, record, k + 1, config.plant.noise);
    eye.batch_error[k] = batch.peak - truth;
    eye.relative_error = std::log(truth / batch.peak);
    eye.relative_sigma = batch.relative_sigma;
  }
  return eye;
}

double rms(const std::vector<double>& squares) {
  return std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0) /
                   static_cast<double>(squares.size()));
}

// The eyes come in the order of alpha.
ConsistencyCycle cycle_of(const std::vector<Eye>& eyes, std::size_t k) {
  ConsistencyCycle cycle;
  std::array<double, 4> count{};
  std::vector<double> squares;
  std::vector<double> batch;
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const double score = eyes[i].error[k] / eyes[i].sigma[k];
    for (const std::size_t group : {std::size_t{0}, 1 + 3 * i / eyes.size()}) {
      count[group] += 1.0;
      cycle.nees[group] += score * score;
      cycle.covered[group] += std::abs(score) <= kWithin ? 1.0 : 0.0;
    }
    squares.push_back(eyes[i].error[k] * eyes[i].error[k]);
    batch.push_back(eyes[i].batch_error[k] * eyes[i].batch_error[k]);
  }
  for (std::size_t group = 0; group < count.size(); ++group) {
    cycle.nees[group] /= count[group];
    cycle.covered[group] /= count[group];
  }
  cycle.rms_K = rms(squares);
  cycle.batch_rms_K = rms(batch);
  return cycle;
}

OfflineBound bound_of(const std::vector<Eye>& eyes, const ControlSettings& control,
                      double probability) {
  const double kappa = normal_quantile(probability);
  OfflineBound bound{.probability = probability};
  std::vector<double> held;
  for (const Eye& eye : eyes) {
    const double aim =
        std::min(control.peak_reference, control.peak_max * std::exp(-kappa * eye.relative_sigma));
    const double truth = aim * std::exp(eye.relative_error);
    held.push_back(truth - control.peak_reference);
    bound.over_limit += truth > control.peak_max ? 1 : 0;
  }
  std::tie(bound.held_K, bound.held_deviation_K) = mean_and_deviation(held);
  return bound;
}

}  // namespace

PosteriorConsistency posterior_consistency(const Campaign& campaign, const SpotModels& models,
                                           std::size_t eyes,
                                           const std::function<void(double)>& progress) {
  const UncertainModel* model = models.controller.uncertain.get();
  if (model == nullptr || !campaign.config.uses_prior()) {
    throw Error(ErrorParts{.where = campaign.file,
                           .key = "estimator.kind",
                           .problem = "the controller has no posterior estimate",
                           .accepted = "\"posterior\", or control.robust = \"chance\""});
  }
  if (!model->seen_before.empty()) {
    throw Error(
        ErrorParts{.where = campaign.file,
                   .key = "photoacoustics.sampling",
                   .found = "\"pulses\"",
                   .accepted = "\"instant\": a batch estimate sees the sample at its time"});
  }
  SpotRunner runner(campaign, models);
  std::vector<Eye> seen;
  for (std::size_t spot = 0; spot < eyes; ++spot) {
    seen.push_back(look_at(runner, *model, spot));
    if (progress) progress(static_cast<double>(spot + 1) / static_cast<double>(eyes));
  }
  std::sort(seen.begin(), seen.end(), [](const Eye& a, const Eye& b) { return a.alpha < b.alpha; });
  PosteriorConsistency out;
  out.eyes = eyes;
  out.period = campaign.config.control.period;
  std::vector<double> squares;
  std::vector<double> batch;
  const std::size_t cycles = campaign.config.cycles();
  for (std::size_t k = 0; k < cycles; ++k) {
    out.cycles.push_back(cycle_of(seen, k));
    if (!has_batch(k, cycles)) continue;
    squares.push_back(std::pow(out.cycles[k].rms_K, 2));
    batch.push_back(std::pow(out.cycles[k].batch_rms_K, 2));
  }
  out.rms_K = rms(squares);
  out.batch_rms_K = rms(batch);
  for (const double probability : kProbabilities) {
    out.bounds.push_back(bound_of(seen, campaign.config.control, probability));
  }
  return out;
}

std::string consistency_csv(const PosteriorConsistency& all) {
  std::string text =
      "time_s,nees,nees_low_alpha,nees_middle_alpha,nees_high_alpha,covered_95,"
      "covered_95_low_alpha,covered_95_middle_alpha,covered_95_high_alpha,rms_error_K,"
      "batch_rms_error_K\n";
  for (std::size_t k = 0; k < all.cycles.size(); ++k) {
    const ConsistencyCycle& cycle = all.cycles[k];
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{}\n",
                   static_cast<double>(k + 1) * all.period, fmt::join(cycle.nees, ","),
                   fmt::join(cycle.covered, ","), cycle.rms_K,
                   std::isfinite(cycle.batch_rms_K) ? fmt::format("{}", cycle.batch_rms_K) : "");
  }
  return text;
}

std::string offline_bound_json(const PosteriorConsistency& all, const Campaign& campaign) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const OfflineBound& bound : all.bounds) {
    points.push_back({{"limit_probability", bound.probability},
                      {"over_limit_spots", bound.over_limit},
                      {"held_mean_error_K", bound.held_K},
                      {"held_std_error_K", bound.held_deviation_K}});
  }
  return nlohmann::ordered_json{{"notice", kResearchNotice},
                                {"spots", all.eyes},
                                {"campaign", campaign.file},
                                {"peak_reference_K", campaign.config.control.peak_reference},
                                {"limit_K", campaign.config.control.peak_max},
                                {"points", points}}
             .dump(2) +
         "\n";
}

}  // namespace photocoag
