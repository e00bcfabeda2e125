// Role: tests of estimation; a reduced model with two parameters, made once per program.
#pragma once

#include "photocoag/mor/reduce.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {

/// A model whose choroid is scaled by beta. Eye and model are the same.
inline const ReducedModel& model_with_beta() {
  static const ReducedModel model = [] {
    const FullOrderModel full(testing::with_beta(), {.min_cells = 4000});
    ReductionSettings settings;
    settings.refinement = Refinement::kNone;
    return project_model(full, reduction_space(full), settings, 1e-3,
                         Discretization::kZeroOrderHold);
  }();
  return model;
}

}  // namespace photocoag::testing
