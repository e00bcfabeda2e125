#include "photocoag/run/replay.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>

#include "photocoag/core/error.hpp"
#include "photocoag/rom/intersample.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/pulse_model.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "photocoag/run/treat.hpp"

namespace photocoag {
namespace {

/// A recorded run as an OpenDevice.
class OpenRecording {
 public:
  using Refusal = Error;
  static constexpr bool kAnySolver = true;

  OpenRecording(const Config& config, ReducedModel model, std::span<const ReplayCycle> cycles,
                SafetyLimits limits, const ObserverModel& observer)
      : noise_(config.plant.noise),
        model_(std::move(model)),
        device_(cycles),
        limits_(limits),
        observer_(observer) {}

  ReplayDevice& device() noexcept { return device_; }
  const ReducedModel& model() const noexcept { return model_; }
  bool timed() const noexcept { return false; }
  SafetyLimits limits() const noexcept { return limits_; }
  ObserverModel observer() const noexcept { return observer_; }
  SelfTestReport self_test(bool) const { return passed_self_test(noise_); }  // the run's was
  void begin(std::size_t) noexcept {}
  void finish(Treatment&) const noexcept {}

 private:
  double noise_;
  ReducedModel model_;
  ReplayDevice device_;
  SafetyLimits limits_;
  ObserverModel observer_;
};

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
    // Without command columns the file has the applied powers, which were written `delay` periods
    // earlier.
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
  // A row marked overrun was already late when the previous one was fetched.
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
  // The configuration of the run's controller: its margin is computed again.
  const Config config = controller_config(asked, models.reduced());
  const bool pulses = config.photoacoustics.sampling == Sampling::kPulses;
  const int per_period = pulses ? pulses_per_period(config) : 1;
  PromptFeedthrough feed;
  if (pulses) feed = prompt_feedthrough(models.model_full(), models.reduced(), per_period);
  const ReducedModel model = pulses ? pulse_averaged_model(models.reduced(), per_period, feed)
                                    : controller_model(models.reduced(), config.estimator.timing);
  // Only runs on a device have a command column.
  const bool device = run.has("power_command_W");
  OpenRecording open(
      config, model, cycles, device ? device_limits(config) : safety_limits(config),
      device ? device_observer(config, pulses ? per_period : 0) : observer_model(config));
  Treatment treatment;
  treatment.records.resize(cycles.size());
  treat(config, open, {}, treatment);
  return {.compared = open.device().compared(),
          .differs_at = std::min(open.device().differs_at(), open.device().compared())};
}

}  // namespace photocoag
