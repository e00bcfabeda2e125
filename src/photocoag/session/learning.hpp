// Role: offline; prior of the next spot's absorption from earlier spots of the same eye. Used by
// session.
// Source: derived here; docs/sessions.md ("What earlier spots teach"). Units: alpha is a factor.
#pragma once

#include <vector>

#include "photocoag/estimation/settings.hpp"
#include "photocoag/session/attempt_outcome.hpp"

namespace photocoag {

/// `configured` with mean and standard deviation of alpha before the first sample from the spots of
/// `earlier` that went to their end; the configured prior has the weight of one spot. The deviation
/// is that of the next spot, not of the mean, and at least `floor`; the mean stays inside the
/// estimator's bounds. Without such a spot: `configured`.
EstimatorSettings learnt(EstimatorSettings configured, const std::vector<AttemptOutcome>& earlier,
                         double floor);

}  // namespace photocoag
