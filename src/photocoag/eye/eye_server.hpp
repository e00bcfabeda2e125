// Role: simulation; the process `photocoag eye`: pulses on its own clock, transports, counts. Used
// by apps, tests. Source: docs/devices.md. Real time: the pulse thread does not allocate and,
// outside lockstep, waits for nobody; sockets have their own thread.
#pragma once

#include <atomic>
#include <string>

#include "photocoag/eye/eye_statistics.hpp"
#include "photocoag/eye/pulsed_eye.hpp"

namespace photocoag {

struct EyeServerOptions {
  std::string socket;
  bool once = false;      ///< end when the first controller has gone
  int foreign_core = -1;  ///< the controller's core, which the pulse thread avoids; -1: none
  /// s of wall time that a controller in lockstep may take per period; then the eye follows the
  /// clock again and its watchdog may act.
  double lockstep_patience = 10.0;
};

/// Serves until `stop`, or with `once` until the first controller has gone. Throws Error only
/// before the first pulse.
EyeStatistics serve_eye(const EyeServerOptions& options, PulsedEye& eye, FaultScript& faults,
                        double pulse_period, const std::atomic<bool>& stop);

}  // namespace photocoag
