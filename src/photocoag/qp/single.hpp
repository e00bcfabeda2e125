// Role: online; the quadratic program of one input and one row, as of N = 2, in closed form. Used
// by qp/dense. Units: none. Real time: noexcept, O(1), no heap; same input, same bits.
#pragma once

#include "photocoag/qp/problem.hpp"

namespace photocoag {

/// True if `solution` is the minimizer, with a KKT residual of at most 1e-14: inside, or, with
/// `may_bind`, at a bound or the row, which counts as one active-set change. False otherwise;
/// DenseSolver then finds the status. Precondition: sizes_match(), one input, one row.
bool solve_single(const QpProblem& problem, bool may_bind, QpSolution& solution) noexcept;

}  // namespace photocoag
