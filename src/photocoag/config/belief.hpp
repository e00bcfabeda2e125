// Role: setup; [[prior]] as the Gaussian in logarithms that the estimator starts from. Used by
// config. Source: docs/uncertainty.md (matched moments). Units: SI.
#pragma once

#include "photocoag/config/prior.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/rom/belief.hpp"

namespace photocoag {

/// Mean and variance of every quantity's logarithm, truncation included; correlations as those of
/// the normal scores. Alpha comes first; where the prior does not have it, from
/// estimator.absorption_initial, _sigma_initial, _min and _max. plant.noise_K is the prior of the
/// sample's noise alone. Nothing if the prior has no quantity. Throws Error for a key that no
/// model carries.
Belief belief_of(const Prior& prior, const EstimatorSettings& estimator);

}  // namespace photocoag
