// Role: offline; runs the configurations of a study over all seeds, on all cores, and measures
// them. Used by reproduce, sweep. Source: paper, sections 4 and 5. Units: in the names.
// Real-time promise: none. Threads: run_all uses its own; the results do not depend on their
// number.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/core/progress.hpp"
#include "photocoag/population/eye_models.hpp"
#include "photocoag/study/expression.hpp"

namespace photocoag {

/// One closed loop; entry k is the end of cycle k, as in run.csv.
struct Trajectory {
  std::vector<double> time_ms, peak_K, peak_estimate_K, volume_K, measured_K, power_mW,
      power_reference_mW, absorption_factor;
};

/// A configuration to run over seeds.
struct RunJob {
  std::string id;
  Config config;  ///< its run.seed is the first seed
};

/// Its results: trajectories by seed, and every measure, one value per seed.
struct RunResult {
  std::string id;
  Config config;
  std::vector<Trajectory> trajectories;
  std::map<std::string, std::vector<double>> measures;
};

/// Models by tissue, period and reduction, each made once. Threads: any.
class ModelPool {
 public:
  explicit ModelPool(bool use_cache) : use_cache_(use_cache) {}
  /// Throws Error if the models cannot be made.
  std::shared_ptr<const EyeModels> get(const Config& config);

 private:
  struct Slot {
    std::once_flag once;
    std::shared_ptr<const EyeModels> models;
  };
  bool use_cache_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Slot>> slots_;
};

/// Seeds config.run.seed … + seeds - 1 of every job. Throws the first Error of any job. `progress`
/// runs on the calling thread.
std::vector<RunResult> run_all(const std::vector<RunJob>& jobs, int seeds, ModelPool& pool,
                               const Progress& progress = {});

/// One closed loop in virtual time.
Trajectory run_once(const Config& config, const EyeModels& models, std::uint64_t seed);

/// Every measure of one trajectory (docs/studies.md lists them).
std::map<std::string, double> measure(const Config& config, const Trajectory& trajectory);

/// Throws Error if there is none of this id.
const RunResult& run_of(const std::vector<RunResult>& results, std::string_view id);

/// Looks terms of predicates up, differences of two runs included. `results` must outlive it.
MeasureSource measures_of(const std::vector<RunResult>& results);

}  // namespace photocoag
