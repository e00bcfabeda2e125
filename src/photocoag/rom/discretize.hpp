// Role: setup; sampling of a small continuous-time model. Used by rom and mor.
// Source: docs/equations.md (E7). Units: SI.
#pragma once

#include <Eigen/Core>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/types.hpp"

namespace photocoag {

struct ReducedModel;

/// x+ = transition * x + input * (B u).
struct DiscretePair {
  Eigen::MatrixXd transition;
  Eigen::MatrixXd input;
};

/// Zero-order hold: e^(Ah) and int_0^h e^(As) ds, from one exponential of [[A, I], [0, 0]] h, so
/// that a singular A is no special case. Implicit Euler: (I - hA)^-1 and h (I - hA)^-1. TR-BDF2:
/// core/discretization.hpp. Allocates.
DiscretePair discretize(const Eigen::MatrixXd& A, double period, Discretization how);

/// The model with twice the states, whose volume temperature is read from the second half: `before`
/// times the first half at the period's start plus `power` (one column per term of B) times the
/// period's power, i.e. the state as sampled within the period.
ReducedModel with_shown_states(const ReducedModel& model, const Eigen::MatrixXd& before,
                               const Eigen::MatrixXd& power);

}  // namespace photocoag
