// Role: online; the tolerances that solvers, polishing and the check share, all relative. Used by
// qp. Source: docs/control.md.
#pragma once

namespace photocoag {

inline constexpr double kPivot = 1e-14;     ///< Cholesky pivot over diagonal: below, not definite
inline constexpr double kViolated = 1e-13;  ///< a constraint is taken up: above rounding in n' u
inline constexpr double kFeasible = 1e-9;   ///< rows that cannot be met better are infeasible
inline constexpr double kSharp = 1e-14;     ///< KKT residual of an answer that is not refined

}  // namespace photocoag
