// Role: online; the minimizer with penalties on powers or power changes where nothing binds, by
// factorizing the Hessian's generators instead of the Hessian. Used by mpc.
// Source: docs/equations.md (E31); T. Kailath, A. H. Sayed (ed.), "Fast Reliable Algorithms for
// Matrices with Structure", SIAM 1999, chapter 1 (generalized Schur algorithm); here all generators
// are positive, so that only rotations are needed.
// Units: K; u = power / u_max. Real time: noexcept, O(n^2), no heap; same input, same bits.
#pragma once

#include "photocoag/mpc/deadbeat.hpp"

namespace photocoag {

/// Terms added to the cost sum_k (peak_k - reference_k)^2 of PlanData:
///   power sum_k (u_k - power_reference)^2 + change ((u_0 - previous)^2 + sum_k (u_k - u_(k-1))^2).
struct PlanPenalties {
  double power = 0.0;            ///< R1 u_max^2, K2; not negative
  double change = 0.0;           ///< R2 u_max^2, K2; not negative
  double power_reference = 0.0;  ///< u_ref
  double previous = 0.0;         ///< u_prev
};

/// The minimizer without box and limits. False, with `u` undefined, if a power leaves the box (a
/// bound is active) or is not finite. Limits are not checked.
bool minimize_penalized(const PlanData& data, const PlanPenalties& penalties, double* u) noexcept;

/// Optimality residual of any `u` in the box and below the limits with no active constraint: the
/// largest |H u + g|_k over |H u|_k + |g|_k, an upper bound of `stationarity` in qp/kkt.hpp.
/// Infinity if a bound or row is violated at all, or if something is not finite. Compare with
/// kDeadbeatResidual.
double penalized_residual(const PlanData& data, const PlanPenalties& penalties,
                          const double* u) noexcept;

}  // namespace photocoag
