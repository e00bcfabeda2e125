#include "photocoag/study/run_set.hpp"

#include <fmt/format.h>

#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/parallel.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {
namespace {

// Key of everything the models depend on; configurations with the same key share them.
std::string key_of(Config config) {
  const double period = config.control.period;
  config.control = ControlSettings{};
  config.control.period = period;
  config.estimator = EstimatorSettings{};
  config.run = RunSettings{};
  config.plant.absorption_factor = 1.0;
  config.plant.noise = 0.0;
  config.plant.bench = BenchSettings{};
  return config_sha256(config);
}

Trajectory trajectory_of(const Treatment& treatment) {
  Trajectory out;
  for (const CycleRecord& record : treatment.records) {
    out.time_ms.push_back(record.time * 1e3);
    out.peak_K.push_back(record.truth.peak);
    out.peak_estimate_K.push_back(record.estimate.outputs.peak);
    out.volume_K.push_back(record.truth.volume);
    out.measured_K.push_back(record.measured);
    out.power_mW.push_back(record.power * 1e3);
    out.power_reference_mW.push_back(record.decision.power_reference * 1e3);
    out.absorption_factor.push_back(record.estimate.absorption_factor);
  }
  return out;
}

}  // namespace

std::shared_ptr<const EyeModels> ModelPool::get(const Config& config) {
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Slot>& found = slots_[key_of(config)];
    if (!found) found = std::make_shared<Slot>();
    slot = found;
  }
  std::call_once(slot->once, [&] {
    slot->models = std::make_shared<const EyeModels>(make_eye_models(config, use_cache_));
  });
  return slot->models;
}

Trajectory run_once(const Config& config, const EyeModels& models, std::uint64_t seed) {
  Config one = config;
  one.run.seed = seed;
  return trajectory_of(treat_eye(one, models.reduced, models.eye()));
}

std::vector<RunResult> run_all(const std::vector<RunJob>& jobs, int seeds, ModelPool& pool,
                               const Progress& progress) {
  std::vector<RunResult> results(jobs.size());
  std::vector<std::vector<std::map<std::string, double>>> measured(jobs.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    results[i].id = jobs[i].id;
    results[i].config = jobs[i].config;
    results[i].trajectories.resize(static_cast<std::size_t>(seeds));
    measured[i].resize(static_cast<std::size_t>(seeds));
  }
  const std::size_t total = jobs.size() * static_cast<std::size_t>(seeds);
  // The controllers' configurations; results are measured against the original configuration.
  std::vector<Config> controlled;
  for (const RunJob& job : jobs) {
    controlled.push_back(controller_config(job.config, pool.get(job.config)->reduced));
  }
  for_each_in_parallel(
      total,
      [&](std::size_t k) {
        const std::size_t job = k / static_cast<std::size_t>(seeds);
        const std::size_t seed = k % static_cast<std::size_t>(seeds);
        const Config& config = jobs[job].config;
        Trajectory loop = run_once(controlled[job], *pool.get(config), config.run.seed + seed);
        measured[job][seed] = measure(config, loop);
        results[job].trajectories[seed] = std::move(loop);
      },
      [&](std::size_t done) {
        if (!progress) return;
        progress(fmt::format("{} of {} runs", done, total),
                 static_cast<double>(done) / static_cast<double>(total));
      });
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    for (const auto& one : measured[i]) {
      for (const auto& [name, value] : one) results[i].measures[name].push_back(value);
    }
  }
  return results;
}

}  // namespace photocoag
