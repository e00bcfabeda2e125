// Role: the program; adapts the configuration to a device. Used by run, session, apps.
// Source: docs/devices.md. Units: SI.
#pragma once

#include "photocoag/config/config.hpp"
#include "photocoag/photoacoustics/curve.hpp"
#include "photocoag/run/device_address.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"

namespace photocoag {

/// Throws Error unless the calibration covers ambient to control.peak_max_K and rises by 0.3 to 15
/// % per K when cold.
void require_plausible(const GrueneisenCurve& curve, const Config& config);

/// The configuration adapted to a device: unchanged for the simulated eye of this process; an eye
/// in another process samples the normalised volume temperature as means over pulses. Throws Error
/// if that is not possible.
Config for_device(Config config, const DeviceAddress& device);

/// s: longest stall of a simulated eye and its controller without real-time scheduling.
inline constexpr double kEyeStall = 0.5;

/// The supervisor's limits on a device.
SafetyLimits device_limits(const Config& config);

/// The observer on a device, always with zero-order hold, whatever plant.discretization; `pulses`
/// as in observer_model.
ObserverModel device_observer(const Config& config, int pulses = 0);

/// Pulses per control period. Throws Error naming photoacoustics.pulse_period_ms.
int pulses_per_period(const Config& config);

}  // namespace photocoag
