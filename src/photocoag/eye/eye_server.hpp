// Role: simulation; the process `photocoag eye`: pulses on its own clock, transports, counts. Used
// by apps, tests. Source: docs/devices.md. Real time: the pulse thread allocates nothing and waits
// for nobody; sockets are served by a thread of their own.
#pragma once

#include <atomic>
#include <string>

#include "photocoag/eye/eye_statistics.hpp"
#include "photocoag/eye/pulsed_eye.hpp"

namespace photocoag {

struct EyeServerOptions {
  std::string socket;
  bool once = false;      ///< end when the first controller has gone
  int foreign_core = -1;  ///< the controller's own: no pulse is made there
  /// s of wall time that a controller in lockstep may take for a period; then the eye follows the
  /// clock again, and its watchdog does what it does.
  double lockstep_patience = 10.0;
};

/// Serves until `stop`, or as `once` says. Throws Error before the first pulse only.
EyeStatistics serve_eye(const EyeServerOptions& options, PulsedEye& eye, FaultScript& faults,
                        double pulse_period, const std::atomic<bool>& stop);

}  // namespace photocoag
