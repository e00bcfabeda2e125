// Role: setup; models whose volume temperature is the mean over the pulses of a period. Used by
// run, tests. Source: docs/photoacoustics.md (P9). Units: SI.
#pragma once

#include <functional>
#include <memory>

#include "photocoag/core/intersample.hpp"
#include "photocoag/crosscheck/lags.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/safety/multi_model_observer.hpp"

namespace photocoag {

/// Mean of a mode over m equidistant pulses of equal energy per period, each sampled just before
/// its own heat; the mode decays by `decay` per period:
///   before * (the mode at the period's start) + power * (the period's contribution to it),
/// both as under constant power.
struct PulseAveragedMode {
  double before = 1.0;
  double power = 0.0;
};
PulseAveragedMode pulse_averaged_mode(double decay, int pulses);

/// K/W, as a function of alpha and beta: direct effect of a period's power on its own sample that
/// the reduced model's modes miss. May be negative.
using PromptFeedthrough = std::function<double(AbsorptionFactors)>;

/// Each pulse samples the tissue before its own heat and so misses heat younger than a pulse
/// period, which constant power would show. Most of that is in fast modes (the thin RPE), which a
/// model of few states lumps together. The difference of the two steady-state shortfalls,
///   sum over the modes of c b (1/l - h / (e^(l h) - 1)),
/// reduced minus full order, times (m - 1) / m: the first pulse of a period precedes all of its
/// power. Empty for one pulse per period and for layers that conduct differently.
PromptFeedthrough prompt_feedthrough(std::shared_ptr<const FullOrderModel> full,
                                     const ReducedModel& model, int pulses);

/// The model with twice the states: the second half is the first half averaged over the last
/// period's pulses, and gives the volume temperature; `feed` (may be empty) is added as the nearest
/// combination of the model's terms. Estimators need no change: the derivative by alpha is right
/// too. Throws Error if the order is above 7, modes oscillate or grow, or the discretization is not
/// zero-order hold.
ReducedModel pulse_averaged_model(const ReducedModel& model, int pulses,
                                  const PromptFeedthrough& feed = {});

/// The same for the observer; the feedthrough comes from the many lags.
void average_over_pulses(ObserverModel& observer, int pulses, const crosscheck::LagSums& lags,
                         double period);

/// The same for intersample timing: delayed or averaged samples, delayed power
/// (core/intersample.hpp).
void average_between_samples(ObserverModel& observer, const IntersampleTiming& timing,
                             const crosscheck::LagSums& lags, double period);

}  // namespace photocoag
