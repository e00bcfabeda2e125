// Role: setup; the cross-check's responses of a configuration's tissue, and the check of the
// controller's model against them. Used by run. Source: docs/safety.md ("The cross-check"). Units:
// SI.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/crosscheck/lags.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Responses of [tissue] by the cross-check: of the observer's absorptions first, then of those
/// that models are compared at. The observer's are spread evenly in logarithm between the
/// estimator's bounds: alpha at the estimator's fixed beta, or all pairs, alpha running fastest, if
/// it estimates both or the prior contains the absorption of a layer, which then takes the role of
/// beta.
struct TissueReference {
  std::vector<AbsorptionFactors> at;
  std::size_t observed = 0;  ///< the first so many are the observer's
  crosscheck::LagSums lags;
};

/// Computed once per tissue, period and bounds in a process (about 0.1 s). Thread-safe.
std::shared_ptr<const TissueReference> tissue_reference(const Tissue& tissue,
                                                        const EstimatorSettings& estimator,
                                                        double period);

/// Compares the model's step responses with the cross-check in the model's own time scheme, at
/// several absorptions. Peak and volume temperature must agree at the end of every period of a run
/// within the model's stated error (up to 25 %) plus 1 % (2 % on the coarsest grid), relative to
/// the response at the run's end; the steady state within twice that error plus 10 %. A certificate
/// must not claim less than the errors found. Throws Error otherwise; `where`: the model's origin.
void check_model(const ReducedModel& model, const Tissue& tissue,
                 const EstimatorSettings& estimator, const std::string& where);

}  // namespace photocoag
