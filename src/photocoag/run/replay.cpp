#include "photocoag/run/replay.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>

#include "photocoag/core/error.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif
#include "photocoag/rom/intersample.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/pulse_model.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {
namespace {

template <PredictiveController M, Supervision S>
ReplayOutcome compare_with(S supervisor, const Config& config, const ReducedModel& model,
                           std::span<const ReplayCycle> cycles) {
  BasicController<M> controller(model, config.control, config.estimator);
  ReplayDevice device(cycles);
  std::vector<CycleRecord> records(cycles.size());
  run_loop(controller, device, supervisor, config.control.period, std::span(records));
  return {.compared = device.compared(),
          .differs_at = std::min(device.differs_at(), device.compared())};
}

template <Supervision S>
ReplayOutcome compare(S supervisor, const Config& config, const ReducedModel& model,
                      std::span<const ReplayCycle> cycles) {
#if PHOTOCOAG_HAS_OSQP
  if (config.control.solver == SolverKind::kOsqp) {
    return compare_with<SparseOsqpController>(supervisor, config, model, cycles);
  }
  if (config.control.solver == SolverKind::kOsqpCondensed) {
    return compare_with<CondensedOsqpController>(supervisor, config, model, cycles);
  }
#endif
  if (config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a run with a solver that needs it",
                 .accepted = "dense"});
  }
  return compare_with<ModelPredictiveController<DenseSolver>>(supervisor, config, model, cycles);
}

}  // namespace

std::vector<ReplayCycle> replay_of(const RunCsv& run, double period, int delay) {
  if (run.cycles.empty()) return {};
  for (const char* column : {"power_W", "volume_measured_K", "overrun", "solver_status"}) {
    run.require(column);
  }
  const auto period_ns = static_cast<std::int64_t>(period * 1e9 + 0.5);
  const bool commanded = run.has("power_command_W");
  std::vector<ReplayCycle> cycles;
  for (const LogRecord& record : run.cycles) {
    ReplayCycle cycle;
    // Without commands the file says what was applied: what was written `delay` periods before.
    const std::size_t shown = cycles.size() + static_cast<std::size_t>(commanded ? 0 : delay);
    cycle.written = commanded                   ? record.authorization.power
                    : shown < run.cycles.size() ? run.cycles[shown].power
                                                : std::numeric_limits<double>::quiet_NaN();
    cycle.readback.power = record.power;
    cycle.readback.command = record.device_command;
    const auto end = static_cast<std::int64_t>(cycles.size() + 1);
    cycle.sample.status = DeviceStatus::kGood;
    cycle.sample.volume_temperature = record.measured;
    cycle.sample.raw = std::bit_cast<std::int64_t>(record.measured);
    cycle.sample.sequence = static_cast<std::uint64_t>(end);
    cycle.sample.time_ns = cycle.sample.now_ns = end * period_ns;
    cycles.push_back(cycle);
  }
  // A row marked overrun lay behind when the one before it was fetched.
  for (std::size_t k = cycles.size(); k-- > 1;) {
    if (run.cycles[k].overrun) {
      cycles[k - 1].sample.periods_behind = cycles[k].sample.periods_behind + 1;
      cycles[k - 1].sample.now_ns = cycles[k].sample.now_ns;
    }
  }
  const bool stopped = run.cycles.back().decision.status == MpcStatus::kStopped;
  if (stopped && cycles.size() > 1) cycles[cycles.size() - 2].sample.stop_asked = true;
  return cycles;
}

ReplayOutcome replay_run(const std::filesystem::path& folder, bool use_cache) {
  const Config asked = load_config((folder / "config.toml").string(), {});
  const RunCsv run = read_run_csv(folder / "run.csv");
  const std::vector<ReplayCycle> cycles = replay_of(run, asked.control.period, asked.control.delay);
  ModelStore models(asked, use_cache);
  // What the run's controller was told: its margin is found again.
  const Config config = told_to_controller(asked, models.reduced());
  const bool pulses = config.photoacoustics.sampling == Sampling::kPulses;
  const int per_period = pulses ? pulses_per_period(config) : 1;
  PromptFeedthrough feed;
  if (pulses) feed = prompt_feedthrough(models.model_full(), models.reduced(), per_period);
  const ReducedModel model = pulses ? pulse_averaged_model(models.reduced(), per_period, feed)
                                    : told_of(models.reduced(), config.estimator.timing);
  if (!config.safety.supervised) return compare(Unsupervised{}, config, model, cycles);
  // Only runs on a device say what was commanded.
  const bool device = run.has("power_command_W");
  // The run has passed its self-test already.
  Supervisor supervisor = begun_supervisor(
      device ? device_limits(config) : safety_limits(config),
      device ? device_observer(config, pulses ? per_period : 0) : observer_model(config),
      passed_self_test(config.plant.noise));
  return compare(supervisor, config, model, cycles);
}

}  // namespace photocoag
