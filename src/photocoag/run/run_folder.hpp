// Role: the program; the files of a run. Used by run, session, campaign, study, console, python,
// apps. Format: docs/run-folder.md. Boundary: every column and key carries its unit.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "photocoag/run/treatment.hpp"
#include "photocoag/tissue/thermal_dose.hpp"

namespace photocoag {

/// The numbers of summary.json.
struct RunSummaryNumbers {
  /// False: no true temperature is known. The numbers about them then keep their defaults and are
  /// null in the file.
  bool truth_known = true;
  double peak_true_max = 0.0;           ///< K; NaN: not known
  double peak_estimate_max = 0.0;       ///< K
  double limit = 0.0;                   ///< K
  std::size_t limit_violations = 0;     ///< cycles whose true peak exceeds the limit
  std::size_t limit_active_cycles = 0;  ///< cycles in whose plan the limit binds
  std::optional<double>
      time_to_95_percent;  ///< s, end of the first cycle with true peak >= 0.95 reference
  std::optional<double> rms_error_after_50_ms;   ///< K, true peak against reference
  std::optional<double> absorption_error_final;  ///< estimate / truth - 1, of a simulated eye
  std::optional<double> choroid_error_final;     ///< the same of beta, if it is estimated
  /// Arrhenius integral at the true peak, one per set of kPublishedDamage; damage at 1.
  std::array<double, kPublishedDamage.size()> thermal_dose{};
  std::string stopped_for;     ///< empty: not stopped
  std::size_t dark_since = 0;  ///< first cycle after the last one with light
};

RunSummaryNumbers summarize(const Config& config, const Treatment& treatment);

/// Claims the folder and writes config.toml. Throws Error.
[[nodiscard]] ClaimedFolder open_run_folder(const std::filesystem::path& folder,
                                            const Config& config);
/// The same in a new folder below `runs/`, named by UTC time and seed, and a number if need be.
[[nodiscard]] ClaimedFolder open_new_run_folder(const Config& config);

/// run.csv and summary.json. Throws Error.
void write_run(const std::filesystem::path& folder, const Config& config,
               const Treatment& treatment);
/// Content of summary.json.
std::string summary_json(const Config& config, const Treatment& treatment);
/// summary.json alone. Throws Error.
void write_summary(const std::filesystem::path& folder, const Config& config,
                   const Treatment& treatment);

}  // namespace photocoag
