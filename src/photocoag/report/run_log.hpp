// Role: offline; reads a run folder (config.toml, run.csv, summary.json). Used by report, study,
// apps. Source: docs/run-folder.md. Differences: further columns and keys are ignored.
// Units: as in the files, in the names. Real-time promise: none. Threads: none.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// The columns of run.csv, one entry per cycle. NaN: the cell was empty or "nan".
struct RunLog {
  std::vector<double> cycle, time_s, power_W;
  std::vector<double> volume_true_K, volume_measured_K, volume_estimate_K;
  std::vector<double> peak_true_K, peak_estimate_K;
  std::vector<double> peak_sigma_K;  ///< NaN unless the log has it
  std::vector<double> absorption_estimate, absorption_sigma;
  std::vector<double> choroid_estimate, choroid_sigma;  ///< NaN unless beta was estimated
  std::vector<double> power_reference_W, solver_iterations;
  std::vector<std::string> solver_status;

  std::size_t cycles() const noexcept { return time_s.size(); }
  bool empty() const noexcept { return time_s.empty(); }
  /// Control period: the end of the first cycle. Precondition: not empty.
  double period_s() const noexcept { return time_s.front(); }
  /// True if the eye was simulated (at least one true peak temperature).
  bool has_truth() const noexcept;
  /// Sum of power times period.
  double energy_J() const noexcept;
};

/// summary.json; empty optionals are null or absent.
struct RunSummary {
  std::optional<double> peak_true_max_K, peak_estimate_max_K;
  double limit_K = 0.0;
  std::optional<std::int64_t> limit_violations, limit_active_cycles;
  std::optional<double> time_to_95_percent_s, rms_error_after_50_ms_K, absorption_error_final;
  std::optional<double> choroid_error_final;  ///< if beta was estimated
  std::int64_t cycles = 0;
  std::optional<std::int64_t> overruns, full_order_states;
  std::optional<std::string> stopped_for;
  std::string seed, config_sha256, version;

  /// One line of the optional object "timing": {"cycle_us": {"median": 3.1, …}, …}.
  struct Timing {
    std::string name;
    std::vector<std::pair<std::string, double>> values;
  };
  std::vector<Timing> timing;
  /// One of the optional object "histograms": {"wake_us": {"bins": [[12, 3], …], …}, …}.
  struct Histogram {
    std::string name;                                         ///< with unit
    std::vector<std::pair<std::int64_t, std::int64_t>> bins;  ///< lower edge, entries; ascending
    std::int64_t below_0 = 0, overflow = 0, without = 0;      ///< entries in no bin
  };
  std::vector<Histogram> histograms;
  /// The optional object "device".
  struct Device {
    std::string name;
    std::optional<std::int64_t> late_commands;
    std::optional<double> pulse_peak_true_max_K;  ///< right after a pulse
    std::string pacing;                           ///< of a simulated eye process, as text
  };
  std::optional<Device> device;
  /// The optional object "chance": the chance constraint on the limit.
  struct Chance {
    double limit_probability = 0.0;
    double kept_deviations =
        0.0;  ///< back-off from the limit, in standard deviations of the peak's logarithm
  };
  std::optional<Chance> chance;
  bool prior_doubtful = false;  ///< the treatment speaks against [[prior]]
  /// The optional object "thermal_dose": parameter set and Arrhenius integral at the peak.
  std::vector<std::pair<std::string, double>> thermal_dose;
};

/// What the report needs from config.toml, and its text.
struct RunConfig {
  std::string text;
  double peak_reference_K = std::numeric_limits<double>::quiet_NaN();
  double power_max_W = std::numeric_limits<double>::quiet_NaN();
  double ambient_C = std::numeric_limits<double>::quiet_NaN();
  std::optional<double> absorption_true;  ///< of the simulated eye
  std::optional<double> choroid_true;     ///< the same
};

/// Parse one file's text; `where` names it in errors.
/// Throws Error with file, line and column (of text or CSV) or key, what was found, what is
/// accepted.
RunLog parse_run_log(std::string_view text, const std::string& where);
RunSummary parse_run_summary(std::string_view text, const std::string& where);
RunConfig parse_run_config(std::string_view text, const std::string& where);

inline constexpr std::size_t kMostRunFileBytes = 500'000'000;  ///< of a file of a run folder

struct RunFiles {
  RunConfig config;
  RunLog log;
  RunSummary summary;
};

/// The files of a run folder. Throws Error as the parsers, or if one cannot be read.
RunFiles read_run_files(const std::filesystem::path& folder);

}  // namespace photocoag
