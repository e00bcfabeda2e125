// Role: setup; what pulses see of a reduced model's state, for estimator and witness. Used by run,
// tests. Source: docs/photoacoustics.md (P9). Units: SI.
#pragma once

#include "photocoag/loop/pulse_sampling.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/safety/witness.hpp"

namespace photocoag {

/// What m pulses of equal energy, evenly over a period, see of a mode that decays by `decay` per
/// period: before * (mode at its start) + power * (what the whole period adds to it).
struct SeenMode {
  double before = 1.0;
  double power = 0.0;
};
SeenMode seen_by_pulses(double decay, int pulses);

/// Throws Error if the model's modes are not real decays, or not made for constant powers exactly.
PulseSampling pulse_sampling(const ReducedModel& model, int pulses);

/// The same for the witness.
void see_pulses(WitnessModel& witness, int pulses);

}  // namespace photocoag
