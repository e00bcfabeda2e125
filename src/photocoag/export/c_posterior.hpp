// Role: setup; the placeholders of an exported posterior estimator and its limit. Used by export.
// Source: docs/uncertainty.md (U1) to (U3). Allocates.
#pragma once

#include <map>
#include <string>

#include "photocoag/estimation/settings.hpp"
#include "photocoag/export/c_numbers.hpp"
#include "photocoag/mpc/settings.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

/// `model` null: the values of a controller without one.
void add_posterior(const UncertainModel* model, const ControlSettings& control,
                   const EstimatorSettings& estimator, const CNumbers& write,
                   std::map<std::string, std::string>& out);

}  // namespace photocoag
