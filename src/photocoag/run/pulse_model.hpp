// Role: setup; models whose volume temperature is what the pulses of a period see of it. Used by
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

/// What m pulses of equal energy, evenly over a period, see on average of a mode that decays by
/// `decay` per period, each just before its own heat:
///   before * (the mode at the period's start) + power * (what the whole period adds to it),
/// both as constant power would have made them.
struct PulseAveragedMode {
  double before = 1.0;
  double power = 0.0;
};
PulseAveragedMode pulse_averaged_mode(double decay, int pulses);

/// K/W, by alpha and beta: how much more of the power of its own period a sample shows than the
/// reduced model's modes say. Negative: less.
using PromptFeedthrough = std::function<double(AbsorptionFactors)>;

/// Each pulse hears the tissue before its own heat, and misses what constant power would show of
/// heat younger than a pulse period. Most of that has already left the thin RPE: fast modes, which
/// a model of few states lumps together. The difference of the two steady shortfalls,
///   sum over the modes of c b (1/l - h / (e^(l h) - 1)),
/// reduced minus full order, times (m - 1) / m: the first pulse of a period has heard none of its
/// power yet. For one pulse per period, and for layers that conduct differently: nothing.
PromptFeedthrough prompt_feedthrough(std::shared_ptr<const FullOrderModel> full,
                                     const ReducedModel& model, int pulses);

/// The model with twice the states: the second half is what the pulses of the last period saw of
/// the first, and the volume temperature is taken from it; `feed` (may be empty) comes on top, as
/// the nearest combination of the model's terms. Estimators need nothing else: the derivative by
/// alpha is the right one. Throws Error if the order is above 7, modes do not decay without
/// oscillating, or the model is not exact for constant powers.
ReducedModel pulse_averaged_model(const ReducedModel& model, int pulses,
                                  const PromptFeedthrough& feed = {});

/// The same for the observer; what its few lags lump together is taken from the many.
void average_over_pulses(ObserverModel& observer, int pulses, const crosscheck::LagSums& lags,
                         double period);

/// The same for samples that are late or means and powers that act late (core/intersample.hpp).
void average_between_samples(ObserverModel& observer, const IntersampleTiming& timing,
                             const crosscheck::LagSums& lags, double period);

}  // namespace photocoag
