// Role: the program; whether a simulated eye's process follows the wall clock or its controller.
// Used by open_device. Source: docs/devices.md, "Wall clock or lockstep".
#pragma once

#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/rt/eye_protocol.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {

struct EyePace {
  bool lockstep = false;
  std::string reason;  ///< why lockstep, empty: by the clock

  /// One line for the user.
  std::string describe() const;
};

/// What is known before the first pulse: the setting, the privileges of both, the cores. Throws
/// Error if lockstep is asked for and the eye's faults take wall time.
EyePace choose_pace(const Config& config, const EyeWelcome& eye, bool own_priority, int cores);

/// What the baseline, made by the clock, has shown: the share of its pulses that came or were taken
/// in late.
EyePace pace_after_baseline(const Config& config, const EyeWelcome& eye, double late);

}  // namespace photocoag
