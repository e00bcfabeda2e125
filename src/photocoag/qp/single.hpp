// Role: online; the quadratic program of one input and one row, as of N = 2, in closed form. Used
// by qp/dense. Units: none. Real time: noexcept, O(1), no heap; same input, same bits.
#pragma once

#include "photocoag/qp/problem.hpp"

namespace photocoag {

/// True if `solution` is the minimizer by the check of every answer, to 1e-14: inside, or, if it
/// `may_bind`, at a bound or the row, which counts as one change of the active set. False for all
/// else, which DenseSolver has a word for. Precondition: sizes_match(), one input, one row.
bool solve_single(const QpProblem& problem, bool may_bind, QpSolution& solution) noexcept;

}  // namespace photocoag
