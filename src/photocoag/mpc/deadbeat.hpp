// Role: online; the plan that meets the reference at every stage, and its check. Used by mpc, where
// such a plan is the minimizer: R1 = R2 = 0 and nothing binds (most cycles). Source:
// docs/equations.md (E30). Units: u by u_max, temperatures in K. Real time: noexcept, bounded by
// O(N^2), no allocation; sums in an order that depends on the number of stages only.
#pragma once

#include "photocoag/core/types.hpp"

namespace photocoag {

/// Stages 0 … stages - 1 of the powers, and of the outputs one period later:
///   peak_k = free_k + sum_(j <= k) impulse_(k-j) u_j, and the same with limit_ for the rows.
struct PlanData {
  int stages = 0;
  const double* impulse = nullptr;        ///< h
  const double* free = nullptr;           ///< f
  const double* reference = nullptr;      ///< of the outputs
  const double* limit_impulse = nullptr;  ///< h of the rows; may be `impulse`
  const double* limit_free = nullptr;     ///< f of the rows
  const double* limit = nullptr;          ///< of the rows' outputs
  double lower = 0.0;                     ///< of every u, not negative
  double upper = 1.0;
};

/// G u = reference - f by forward substitution. False, with `u` undefined, if a power leaves the
/// box (a bound is active) or is not finite.
bool meet_reference(const PlanData& data, double* u) noexcept;

/// Optimality residual of any `u` for sum_k (peak_k - reference_k)^2 in the box and below the
/// limits with no active constraint: the largest |peak - reference|_k over (G u)_k, an upper bound
/// of `stationarity` in qp/kkt.hpp, since the impulse responses are not negative. Infinity if a
/// bound or row is violated at all, if an impulse response is negative or if something is not
/// finite.
double deadbeat_residual(const PlanData& data, const double* u) noexcept;

/// Upper limit of deadbeat_residual(); 1e-15 is typical.
inline constexpr double kDeadbeatResidual = 1e-13;

}  // namespace photocoag
