#include "photocoag/run/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>

#include "photocoag/core/csv.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/pulse_model.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kLargestRun = std::size_t{1} << 30;  // bytes

/// A run.csv row by row, cells by the names of their columns.
class Table {
 public:
  explicit Table(const std::string& file) : rows_(read_file(file, kLargestRun, "run.csv"), file) {
    rows_.next();
    names_.assign(rows_.cells().begin(), rows_.cells().end());
  }
  bool next() {
    if (!rows_.next()) return false;
    if (rows_.cells().size() != names_.size()) {
      fail("", fmt::format("{} cells", rows_.cells().size()),
           fmt::format("{} cells", names_.size()));
    }
    return true;
  }
  std::string_view text(std::string_view column) const {
    const auto name = std::find(names_.begin(), names_.end(), column);
    if (name == names_.end()) fail(column, "no such column", "a run.csv of this version");
    return rows_.cells()[static_cast<std::size_t>(name - names_.begin())];
  }
  bool has(std::string_view column) const {
    return std::find(names_.begin(), names_.end(), column) != names_.end();
  }
  double number(std::string_view column) const {
    const std::string_view cell = text(column);
    if (cell.empty()) return std::numeric_limits<double>::quiet_NaN();
    double value = 0.0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc() || end != cell.data() + cell.size()) {
      fail(column, std::string(cell), "a number");
    }
    return value;
  }

 private:
  [[noreturn]] void fail(std::string_view key, std::string found, std::string accepted) const {
    throw Error(ErrorParts{.where = rows_.place(),
                           .key = std::string(key),
                           .found = std::move(found),
                           .accepted = std::move(accepted)});
  }
  CsvReader rows_;
  std::vector<std::string> names_;
};

template <Supervision S>
ReplayOutcome compare(S supervisor, const Config& config, const ReducedModel& model,
                      std::span<const ReplayCycle> cycles) {
  Controller controller(model, config.control, config.estimator);
  ReplayDevice device(cycles);
  std::vector<CycleRecord> records(cycles.size());
  std::atomic<std::size_t> progress{0};
  run_loop(controller, device, supervisor, config.control.period, std::span(records), progress);
  return {.compared = device.compared(),
          .differs_at = std::min(device.differs_at(), device.compared())};
}

}  // namespace

std::vector<ReplayCycle> read_replay(const std::string& csv_file, double period) {
  Table table(csv_file);
  const auto period_ns = static_cast<std::int64_t>(period * 1e9 + 0.5);
  std::vector<ReplayCycle> cycles;
  std::vector<bool> overrun;
  bool stopped = false;
  while (table.next()) {
    ReplayCycle cycle;
    cycle.written = cycle.readback.power = table.number("power_W");
    if (table.has("power_command_W")) cycle.written = table.number("power_command_W");
    if (table.has("device_command_W")) cycle.readback.command = table.number("device_command_W");
    const auto end = static_cast<std::int64_t>(cycles.size() + 1);
    cycle.sample.status = DeviceStatus::kGood;
    cycle.sample.volume_temperature = table.number("volume_measured_K");
    cycle.sample.raw = std::bit_cast<std::int64_t>(cycle.sample.volume_temperature);
    cycle.sample.sequence = static_cast<std::uint64_t>(end);
    cycle.sample.time_ns = cycle.sample.now_ns = end * period_ns;
    overrun.push_back(table.number("overrun") != 0.0);
    stopped = table.text("solver_status") == "stopped";
    cycles.push_back(cycle);
  }
  // A row marked overrun lay behind when the one before it was fetched.
  for (std::size_t k = cycles.size(); k-- > 1;) {
    if (overrun[k]) {
      cycles[k - 1].sample.periods_behind = cycles[k].sample.periods_behind + 1;
      cycles[k - 1].sample.now_ns = cycles[k].sample.now_ns;
    }
  }
  if (stopped && cycles.size() > 1) cycles[cycles.size() - 2].sample.stop_asked = true;
  return cycles;
}

ReplayOutcome replay_run(const std::filesystem::path& folder, bool use_cache) {
  const Config asked = load_config((folder / "config.toml").string(), {});
  const std::vector<ReplayCycle> cycles =
      read_replay((folder / "run.csv").string(), asked.control.period);
  ModelStore models(asked, use_cache);
  // What the run's controller was told: its margin is found again.
  const Config config = told_to_controller(asked, models.reduced());
  const bool pulses = config.photoacoustics.sampling == Sampling::kPulses;
  const int per_period = pulses ? pulses_per_period(config) : 1;
  PulseFeed feed;
  if (pulses) feed = feed_of_fresh_heat(models.model_full(), models.reduced(), per_period);
  const ReducedModel model =
      pulses ? seen_by_pulses(models.reduced(), per_period, feed) : models.reduced();
  if (!config.safety.supervised) return compare(Unsupervised{}, config, model, cycles);
  WitnessModel witness = witness_model(models.reduced(), config.estimator);
  if (pulses) see_pulses(witness, per_period, feed);
  // Only runs on a device say what was commanded.
  const bool device = Table((folder / "run.csv").string()).has("power_command_W");
  Supervisor supervisor(device ? device_limits(config) : safety_limits(config), witness);
  supervisor.power_on();
  // The run has passed its self-test already.
  supervisor.finish_self_test(passed_self_test(config.plant.noise));
  supervisor.ready();
  supervisor.begin(true);
  return compare(supervisor, config, model, cycles);
}

}  // namespace photocoag
