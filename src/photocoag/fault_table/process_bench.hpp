// Role: safety tests; common data of the process rows at one absorption. Used by fault_table.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "photocoag/core/temporary_folder.hpp"
#include "photocoag/fault_table/process_trials.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {

struct ProcessBench {
  ProcessBench(const ProcessFaultOptions& options, double absorption)
      : config(load_config("", {"safety.real_time=enforce",
                                "grid.min_cells=" + std::to_string(options.min_cells)})),
        models(config, true),
        model(models.reduced()),
        observer(observer_model(config)),
        eye(models.plant_full(), config.plant.discretization, config.control.period, absorption),
        controller(model, config.control, config.estimator) {
    config.plant.absorption_factor = absorption;
  }

  SimulatedEye<FullOrderPlant> fresh_eye(std::uint64_t seed) const {
    return SimulatedEye(eye, config.plant.noise, seed, {}, VirtualPace(config.control.period));
  }

  /// A supervisor in TREATING; the self-test passes except for `log_has_room`.
  Supervisor supervisor(const SafetyLimits& limits, bool log_has_room = true) const {
    Supervisor supervisor(limits, observer);
    supervisor.power_on();
    SelfTestReport report = passed_self_test(limits.noise);
    report.log_has_room = log_has_room;
    supervisor.finish_self_test(report);
    supervisor.ready();
    supervisor.begin(true);
    return supervisor;
  }

  Config config;
  ModelStore models;
  const ReducedModel& model;
  ObserverModel observer;
  FullOrderPlant eye;  // cold
  Controller controller;
};

/// A temporary folder, removed by the destructor.
class ScratchFolder {
 public:
  ScratchFolder() : path_(make_temporary_folder("photocoag-faults-")) {}
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace photocoag
