// Role: online; residual of the Karush-Kuhn-Tucker conditions, independent of the solver. Used by
// every solver on every answer. Source: docs/control.md (the conditions), docs/equations.md. Units:
// none; every residual is relative to the terms that cancel in it, hence invariant under scaling of
// rows or objective. Real time: noexcept, O(n (n + m)), no heap; same input, same bits.
#pragma once

#include "photocoag/qp/problem.hpp"

namespace photocoag {

/// For lower <= u <= upper, G u <= limit, H u + g + G' l + b = 0, l >= 0, b_j > 0 at upper only and
/// b_j < 0 at lower only. Infinity where something is not finite.
struct KktResidual {
  /// max_j |H u + g + G' l + b|_j over the sum of the absolute terms in it, with the inputs as
  /// large as the largest |u_k| sqrt(H_kk) makes them, but not larger than the box
  double stationarity = std::numeric_limits<double>::infinity();
  /// largest violation of a row over max(|limit|, sum_j |G_ij| max(|lower_j|, |upper_j|)), or of a
  /// bound over max(|lower_j|, |upper_j|); rows without reach as in problem.hpp
  double feasibility = std::numeric_limits<double>::infinity();
  /// max |slack times multiplier|, and a negative l times its row's scale, over the energy: the sum
  /// over j of the terms of stationarity times the inputs there
  double complementarity = std::numeric_limits<double>::infinity();

  double largest() const noexcept;
};

/// Size of u independent of the box: max_j of |u_j| sqrt(H_jj) and |g_j| / sqrt(H_jj).
double curved_size(const QpProblem& problem, const double* u) noexcept;

/// Precondition: sizes of `solution` fit `problem`, whose data are finite (examine() in
/// problem.hpp). Tests: tests/qp/test_kkt.cpp.
KktResidual evaluate_kkt(const QpProblem& problem, const QpSolution& solution) noexcept;

/// Upper bound of `stationarity` for `u` with all multipliers 0: max_j |H u + g|_j over the sum of
/// the absolute terms in it. Infinity if a bound or row is violated at all, or if something is not
/// finite (a limit may be +infinity). Precondition: sizes only; all data are checked here.
double inner_residual(const QpProblem& problem, const double* u) noexcept;

/// The same for one input and one row.
inline double inner_residual_single(const QpProblem& problem, double u) noexcept {
  const double gradient = *problem.gradient.data();
  const double lower = *problem.lower.data();
  const double upper = *problem.upper.data();
  const double term = *problem.hessian.data() * u;
  const double value = *problem.rows.data() * u;
  const double terms = std::abs(gradient) + std::abs(term);
  // False for NaN. No branches: all conditions hold where nothing binds.
  const bool good = int(u >= lower) & int(u <= upper) & int(lower > -kInfinity) &
                    int(upper < kInfinity) & int(value > -kInfinity) &
                    int(value <= *problem.limit.data()) & int(terms < kInfinity);
  const double error = std::abs(gradient + term);
  return good ? (error > 0.0 ? error / terms : 0.0) : kInfinity;
}

/// What every solver's answer must satisfy before a power is written: stationarity to 1e-11,
/// feasibility and complementarity to 1e-9. Typical answers have about 1e-16.
bool is_optimal(const KktResidual& kkt) noexcept;

}  // namespace photocoag
