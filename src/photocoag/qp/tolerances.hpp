// Role: online; relative tolerances shared by the solvers, the polishing and the KKT check. Used by
// qp. Source: docs/control.md.
#pragma once

namespace photocoag {

inline constexpr double kPivot = 1e-14;     ///< Cholesky pivot over diagonal; below: not definite
inline constexpr double kViolated = 1e-13;  ///< violation of a constraint; above rounding in n' u
inline constexpr double kFeasible = 1e-9;   ///< violation of rows that counts as infeasible
inline constexpr double kSharp = 1e-14;     ///< KKT residual up to which an answer is not refined

}  // namespace photocoag
