// Role: the program; chooses whether a simulated eye's process follows the wall clock or its
// controller.
// Used by open_device. Source: docs/devices.md, "Wall clock or lockstep".
#pragma once

#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/rt/eye_protocol.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {

struct EyePace {
  bool lockstep = false;
  std::string reason;  ///< why lockstep; empty: by the clock

  /// One line for the user.
  std::string describe() const;
};

/// Decides before the first pulse, from the setting, the privileges of both processes and the
/// cores. Throws Error if lockstep is requested and the eye's faults need wall time.
EyePace choose_pace(const Config& config, const EyeWelcome& eye, bool own_priority, int cores);

/// Decides after a baseline by the clock. `late`: fraction of its pulses that were answered or read
/// late.
EyePace pace_after_baseline(const Config& config, const EyeWelcome& eye, double late);

}  // namespace photocoag
