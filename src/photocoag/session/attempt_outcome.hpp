// Role: offline; outcome of one spot of a session: numbers of its treatment, as JSON and as
// columns. Used by session. Units: in the names.
#pragma once

#include <cstddef>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

enum class SpotEnding {
  kPlanned,         ///< not begun
  kTreated,         ///< to its planned end
  kGoalMissed,      ///< to the end of its duration, without its hold or dose
  kOverLimit,       ///< to its end, the true peak above the limit
  kStopped,         ///< by the supervisor
  kDeviceFault,     ///< by the supervisor or before the loop, because of the device
  kInterrupted,     ///< by the user, at 0 W
  kMayHaveEmitted,  ///< begun; the program died before the end
  kSkipped,         ///< by the operator
};
inline constexpr std::size_t kSpotEndings = 9;

/// A word for files ("may-have-emitted"), and text for users.
std::string_view word_of(SpotEnding ending) noexcept;
std::string_view words_of(SpotEnding ending) noexcept;

/// True if the spot's treatment was complete, so that its estimates count.
bool is_complete(SpotEnding ending) noexcept;

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

struct AttemptOutcome {
  std::string spot;
  int attempt = 0;     ///< 1, 2, …; 0: not begun
  std::string folder;  ///< below the session's
  SpotEnding ending = SpotEnding::kPlanned;
  std::string why;         ///< empty, or the reason
  double energy_mJ = 0.0;  ///< if it may have emitted: upper bound
  double exposure_ms = 0.0;
  double cycles = 0.0;
  double overruns = 0.0;
  double peak_true_max_K = kNotKnown;
  double peak_estimate_max_K = kNotKnown;
  double time_to_95_ms = kNotKnown;     ///< of the true peak, else of the estimate
  double held_error_K = kNotKnown;      ///< mean of that peak minus reference, second half
  double absorption = kNotKnown;        ///< final estimate
  double absorption_sigma = kNotKnown;  ///< as stated by the estimator
  double prior = kNotKnown;             ///< absorption_initial
  double prior_sigma = kNotKnown;
  double residual_K = kNotKnown;        ///< mean of measured minus estimated volume, second half
  double residual_sigma_K = kNotKnown;  ///< its standard error
  double power_ratio = kNotKnown;       ///< emitted energy over commanded, where both are known
  double thermal_dose = kNotKnown;      ///< dose of the goal, Arrhenius integral
};

/// Outcome of a finished treatment.
AttemptOutcome outcome_of(const Config& config, const Treatment& treatment);

nlohmann::ordered_json to_json(const AttemptOutcome& outcome);
/// Throws Error naming `where`.
AttemptOutcome outcome_from_json(const nlohmann::ordered_json& json, const std::string& where);

/// A number of an outcome, for tables.
struct OutcomeNumber {
  std::string_view name;
  std::string_view unit;
  std::string_view meaning;
  double AttemptOutcome::*value;
};
const std::vector<OutcomeNumber>& outcome_numbers();

}  // namespace photocoag
