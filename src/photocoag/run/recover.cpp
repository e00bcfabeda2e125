#include "photocoag/run/recover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/run_folder.hpp"

namespace photocoag {
namespace {

void add(DurationHistogram& histogram, std::int64_t ns) {
  if (ns == LogRecord::kNoTime) {
    histogram.skip();
  } else {
    histogram.add(ns);
  }
}

// True if the last record in the log is not the last one produced: the disk was full.
bool end_is_missing(const LogContent& log) {
  const std::uint64_t seen =
      log.records.empty() ? 0 : static_cast<std::uint64_t>(log.records.back().record) + 1;
  return seen < log.totals.produced;
}

// Histograms have 2000 bins per ms of period: longer ones in a header are not accepted.
constexpr double kLongestPeriod = 0.1;  // s

}  // namespace

Treatment treatment_from(const LogContent& log) {
  Treatment treatment;
  treatment.recovered = !log.closed || end_is_missing(log);
  const double period = log.header.period;
  if (period > 0.0 && period <= kLongestPeriod) treatment.histograms = CycleHistograms(period);
  const bool timed =
      std::any_of(log.records.begin(), log.records.end(),
                  [](const LogRecord& record) { return record.wake_late != LogRecord::kNoTime; });
  if (!timed) treatment.histograms = CycleHistograms();  // an eye in lockstep
  for (const LogRecord& record : log.records) {
    treatment.records.push_back(record);
    treatment.outcome.overruns += record.overrun ? 1 : 0;
    if (!timed) continue;
    add(treatment.histograms.wake_late, record.wake_late);
    add(treatment.histograms.compute, record.compute);
    add(treatment.histograms.write, record.write);
    add(treatment.histograms.slack, record.slack);
  }
  treatment.outcome.cycles = treatment.records.size();
  if (!log.records.empty()) {
    const LogRecord& last = log.records.back();
    treatment.outcome.safety = last.end.safety;
    treatment.outcome.safety.state = last.safety;
    // The planned end comes after the last record.
    if (!treatment.recovered && last.safety == SafetyState::kTreating) {
      treatment.outcome.safety.state = SafetyState::kDone;
    }
    treatment.outcome.stopped = last.safety == SafetyState::kSafeStop ||
                                last.end.safety.reason != SafetyReason::kNone ||
                                last.decision.status == MpcStatus::kStopped;
  }
  treatment.full_order_states =
      static_cast<std::size_t>(std::max<std::int64_t>(0, log.header.full_order_states));
  treatment.log.totals = {
      .produced = log.totals.produced,
      .written = log.records.size(),
      .dropped =
          log.totals.produced - std::min<std::uint64_t>(log.totals.produced, log.records.size())};
  treatment.log.segments = std::max<std::int64_t>(1, log.header.segment + 1);
  if (!log.closed) treatment.log.trouble = "the log was not closed: the last 100 ms may be missing";
  if (const std::uint64_t lost = treatment.log.totals.dropped; lost > 0) {
    treatment.log.trouble +=
        fmt::format("{}{} of {} records are not in the log",
                    treatment.log.trouble.empty() ? "" : "; ", lost, log.totals.produced);
  }
  return treatment;
}

LogContent recover_run(const std::filesystem::path& folder) {
  const std::string csv = (folder / "run.csv").string();
  const bool has_table = std::filesystem::exists(csv);
  if (has_table && std::filesystem::exists(folder / "summary.json")) {
    throw Error(ErrorParts{.where = csv,
                           .problem = "there is nothing to recover",
                           .found = "a complete run folder",
                           .accepted = "one without run.csv or summary.json"});
  }
  const Config config = load_config((folder / "config.toml").string(), {});
  const std::vector<std::filesystem::path> files = segments_of(folder);
  if (files.empty()) {
    throw Error(ErrorParts{.where = (folder / "log").string(),
                           .problem = "there is no log segment",
                           .accepted = "the folder of a run that `treat` has begun"});
  }
  LogContent log = read_segments(files);
  if (log.header.config_sha256 != config_sha256(config)) {
    throw Error(ErrorParts{.where = (folder / "log").string(),
                           .key = "config_sha256",
                           .problem = "the log belongs to another configuration",
                           .found = log.header.config_sha256,
                           .accepted = config_sha256(config)});
  }
  Treatment treatment = treatment_from(log);
  treatment.log.segments = static_cast<std::int64_t>(files.size());
  if (!log.header.device.empty()) {
    const bool pulses = config.photoacoustics.sampling == Sampling::kPulses;
    treatment.device = DeviceReport{.name = log.header.device,
                                    .pulses_per_period = pulses ? pulses_per_period(config) : 0,
                                    .pulse_peak_max = std::numeric_limits<double>::quiet_NaN(),
                                    .status = "not known: recovered from the log",
                                    .pacing = {}};
  }
  if (has_table) {
    // The disk was full after run.csv: that has every cycle, the log perhaps not.
    write_summary(folder, config, treatment);
  } else {
    write_run(folder, config, treatment);
  }
  return log;
}

}  // namespace photocoag
