// Role: setup; models whose volume temperature is what the pulses of a period see of it. Used by
// run, tests. Source: docs/photoacoustics.md (P9). Units: SI.
#pragma once

#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/safety/witness.hpp"

namespace photocoag {

/// What m pulses of equal energy, evenly over a period, see on average of a mode that decays by
/// `decay` per period, each just before its own heat:
///   before * (the mode at the period's start) + power * (what the whole period adds to it),
/// both as constant power would have made them.
struct SeenMode {
  double before = 1.0;
  double power = 0.0;
};
SeenMode seen_by_pulses(double decay, int pulses);

/// The model with twice the states: the second half is what the pulses of the last period saw of
/// the first, and the volume temperature is taken from it. Estimators need nothing else: the
/// derivative by alpha is the right one. Throws Error if the order is above 7, modes do not decay
/// without oscillating, or the model is not exact for constant powers.
ReducedModel seen_by_pulses(const ReducedModel& model, int pulses);

/// The same for the witness.
void see_pulses(WitnessModel& witness, int pulses);

}  // namespace photocoag
