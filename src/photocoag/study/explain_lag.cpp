// Sets with many repetitions: what could be seen of them, the lag that a replay finds, remedies.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/estimation/ekf.hpp"
#include "photocoag/rom/intersample.hpp"
#include "photocoag/study/explain.hpp"
#include "photocoag/study/expression.hpp"

namespace photocoag {
namespace {

constexpr int kOtherSeeds = 1000;  // than those of the search

// Middle of the sample's window behind the power, beyond what the estimator is told.
double unknown_lag(const Config& config) {
  const auto middle = [](const IntersampleTiming& timing) {
    return timing.power_lag + timing.sample_lag + 0.5 * timing.averaging;
  };
  return middle(config.plant.bench.timing) - middle(config.estimator.timing);
}

void find_lags(const Explanation& study, const RunResult& run, ModelPool& pool, ConfirmedSet& out) {
  Config exact = run.config;  // a lag can be told to such a model only
  exact.model.discretization = Discretization::kZeroOrderHold;
  const ReducedModel& model = pool.get(exact)->reduced;
  std::vector<std::vector<double>> misfits(study.lags.size());
  for (const Trajectory& loop : run.trajectories) {
    std::size_t best = 0;
    for (std::size_t i = 0; i < study.lags.size(); ++i) {
      misfits[i].push_back(replay_misfit(model, run.config.estimator, study.lags[i], loop));
      if (misfits[i].back() < misfits[best].back()) best = i;
    }
    out.found_lags.push_back(study.lags[best]);
  }
  for (std::vector<double>& one : misfits) {
    out.lag_misfit.push_back(statistic_of("median", std::move(one)));
  }
}

RunJob remedy_job(const Explanation& study, const std::vector<std::string>& set,
                  const RemedyPlan& plan, const double* found_lag) {
  std::vector<std::string> all = study.set;
  all.insert(all.end(), set.begin(), set.end());
  all.insert(all.end(), plan.does.set.begin(), plan.does.set.end());
  if (found_lag != nullptr) {
    all.push_back(
        fmt::format("estimator.sample_lag_periods={}", std::min(1.0, *found_lag + plan.more)));
  }
  try {
    return {plan.does.label, load_config("", all)};
  } catch (const Error& error) {
    throw Error(
        fmt::format("{}: remedy {}: {}", study.file.string(), plan.does.label, error.what()));
  }
}

// One job per seed, so that each may be told its own lag.
std::vector<RunJob> remedy_jobs(const Explanation& study, const std::vector<std::string>& set,
                                const RemedyPlan& plan, const std::vector<double>& found_lags) {
  std::vector<RunJob> jobs;
  for (std::size_t s = 0; s < found_lags.size(); ++s) {
    jobs.push_back(remedy_job(study, set, plan, plan.told_found_lag ? &found_lags[s] : nullptr));
    jobs.back().config.run.seed += 2 * kOtherSeeds + s;
  }
  return jobs;
}

}  // namespace

double replay_misfit(const ReducedModel& model, EstimatorSettings settings, double lag,
                     const Trajectory& run, std::vector<double>* peaks) {
  settings.timing = {.averaging = 0.0, .sample_lag = lag, .power_lag = 0.0};
  ExtendedKalmanFilter filter(controller_model(model, settings.timing), settings);
  double sum = 0.0;
  double samples = 0.0;
  for (std::size_t k = 0; k < run.power_mW.size(); ++k) {
    filter.predict(run.power_mW[k] * 1e-3);
    if (peaks != nullptr) peaks->push_back(filter.outputs().peak);
    const UpdateStatus status = filter.update(run.measured_K[k]);
    if (status != UpdateStatus::kUpdated && status != UpdateStatus::kOutlier) continue;
    sum += std::pow(filter.innovation() / filter.innovation_sigma(), 2);
    samples += 1.0;
  }
  return sum / std::max(samples, 1.0);
}

RunResult reread(const RunResult& run, PeakReading reading, const ReducedModel& model) {
  RunResult out = run;
  if (reading == PeakReading::kEstimate) return out;
  out.measures.clear();
  for (Trajectory& loop : out.trajectories) {
    std::vector<double> peaks;
    if (reading == PeakReading::kPrediction) {
      replay_misfit(model, run.config.estimator, 0.0, loop, &peaks);
    } else {
      EstimatorSettings settings = run.config.estimator;
      settings.timing = {};
      settings.absorption_initial = loop.absorption_factor.back();
      ExtendedKalmanFilter filter(model, settings);
      for (const double power : loop.power_mW) {
        filter.predict(power * 1e-3);
        peaks.push_back(filter.outputs().peak);
      }
    }
    loop.peak_estimate_K = std::move(peaks);
    for (const auto& [name, value] : measure(run.config, loop)) {
      out.measures[name].push_back(value);
    }
  }
  return out;
}

ConfirmedSet confirm(const Explanation& study, const LabelledSet& set, int seeds, ModelPool& pool) {
  ConfirmedSet out;
  out.label = set.label;
  out.runs = run_all(explained_jobs(study, set.set, kOtherSeeds), seeds, pool);
  for (std::size_t reading = 0; reading < kReadings; ++reading) {
    std::vector<RunResult> read;
    for (const RunResult& run : out.runs) {
      read.push_back(reread(run, static_cast<PeakReading>(reading), pool.get(run.config)->reduced));
    }
    out.readings.push_back({judge_repetitions(study, read),
                            run_of(read, study.hot_run).measures.at("estimate_over_limit_K")});
  }
  const RunResult& hot = run_of(out.runs, study.hot_run);
  out.over_true_K = hot.measures.at("over_limit_K");
  out.true_lag = unknown_lag(hot.config);
  find_lags(study, run_of(out.runs, study.lag_run), pool, out);
  return out;
}

std::vector<Remedy> try_remedies(const Explanation& study, const std::vector<std::string>& set,
                                 const ConfirmedSet& best, ModelPool& pool) {
  // Against what was asked for: a remedy may aim lower.
  const ControlSettings& asked = run_of(best.runs, study.hot_run).config.control;
  std::vector<Remedy> out;
  for (const RemedyPlan& plan : study.remedies) {
    std::vector<double> peaks, estimates, held, times;
    std::size_t over = 0;
    for (const RunResult& run : run_all(remedy_jobs(study, set, plan, best.found_lags), 1, pool)) {
      const ControlSettings& control = run.config.control;
      peaks.push_back(run.measures.at("peak_max_K").front());
      estimates.push_back(run.measures.at("estimate_over_limit_K").front() + control.peak_max);
      held.push_back(run.measures.at("late_mean_error_K").front() + control.peak_reference -
                     asked.peak_reference);
      times.push_back(run.measures.at("time_to_95_ms").front());
      over += peaks.back() > asked.peak_max ? 1 : 0;
    }
    out.push_back({.label = plan.does.label,
                   .estimate_K = statistic_of("max", estimates),
                   .true_K = statistic_of("max", peaks),
                   .held_K = statistic_of("mean", held),
                   .time_to_95_ms = statistic_of("median", times),
                   .over = over});
  }
  return out;
}

}  // namespace photocoag
