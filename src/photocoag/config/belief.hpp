// Role: setup; converts [[prior]] to the Gaussian in logarithms that the estimator starts from.
// Used by config. Source: docs/uncertainty.md (the prior). Units: SI.
#pragma once

#include "photocoag/config/prior.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/rom/belief.hpp"

namespace photocoag {

/// Mean and variance of every quantity's logarithm, truncation included; correlations as those of
/// the normal scores. Alpha comes first; if not in the prior, it is taken from
/// estimator.absorption_initial, _sigma_initial, _min and _max. plant.noise_K becomes the prior of
/// the sample's noise. Empty if the prior has no quantity. Throws Error for a key that no model
/// carries.
Belief belief_of(const Prior& prior, const EstimatorSettings& estimator);

}  // namespace photocoag
