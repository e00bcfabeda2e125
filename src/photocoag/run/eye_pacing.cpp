#include "photocoag/run/eye_pacing.hpp"

#include <fmt/format.h>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr double kMostLate = 0.05;

// Auto, and nothing demands the wall clock.
bool free_to_choose(const Config& config, const EyeWelcome& eye) noexcept {
  return config.photoacoustics.eye_pacing == EyePacing::kAuto &&
         config.safety.real_time != RealTimeMode::kEnforce && (eye.abilities & kEyeNeedsWall) == 0;
}

}  // namespace

std::string EyePace::describe() const {
  if (!lockstep) return "by the clock";
  return "in lockstep: " + reason + "; the eye waits for the controller, real time is not measured";
}

EyePace choose_pace(const Config& config, const EyeWelcome& eye, bool own_priority, int cores) {
  if (config.photoacoustics.eye_pacing == EyePacing::kLockstep) {
    if ((eye.abilities & kEyeNeedsWall) != 0) {
      throw Error(ErrorParts{.where = "photoacoustics.eye_pacing",
                             .problem = "the eye's faults (T1, A4) take wall time",
                             .found = "lockstep",
                             .accepted = "\"wall\" or \"auto\""});
    }
    return {true, "asked for"};
  }
  if (!free_to_choose(config, eye)) return {};
  if (!own_priority || (eye.abilities & kEyeHasPriority) == 0) {
    return {true, "SCHED_FIFO is not granted"};
  }
  if (cores < 2) return {true, "one core for eye and controller"};
  return {};
}

EyePace pace_after_baseline(const Config& config, const EyeWelcome& eye, double late) {
  if (!free_to_choose(config, eye) || late <= kMostLate) return {};
  return {true, fmt::format("{:.0f} % of the baseline's pulses were late", 100.0 * late)};
}

}  // namespace photocoag
