// Role: benchmark and tests; the minimizer of a QpProblem to about 18 digits, for any size. Used by
// `bench qp`, tests/qp. Method: a solver's answer names an active set; the equality-constrained
// minimizer on it is recomputed in long double, by elimination with complete pivoting, and accepted
// only if it satisfies all KKT conditions in long double. Only the minimizer of a strictly convex
// problem does: a wrong guess cannot pass. Units: none.
// Real-time promise: none; O((n + m)^3) in long double.
#pragma once

#include <optional>
#include <vector>

#include "photocoag/qp/problem.hpp"

namespace photocoag {

struct QpReference {
  std::vector<long double> power;   ///< u, n
  long double kkt_violation = 0.0;  ///< relative, of u; at most the tolerance asked for
};

/// The minimizer, or nullopt if the active set of `guess` is not that of the minimizer.
/// `tolerance`: on every KKT condition, relative to its terms; 1e-15 leaves room for the condition
/// of the active set (long double rounds at 1e-19).
std::optional<QpReference> reference_minimizer(const QpProblem& problem, const QpSolution& guess,
                                               long double tolerance = 1e-15L);

}  // namespace photocoag
