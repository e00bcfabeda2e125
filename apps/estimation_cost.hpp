// Role: the program; computing time of an estimator, for `estimation` and its comparison.
#pragma once

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Median of predict and update together over one open-loop treatment, us.
double estimator_cost_us(const Config& config, const ReducedModel& model,
                         const EstimatorSettings& settings);

}  // namespace photocoag
