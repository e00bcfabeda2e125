// Role: offline; the span of the impulse responses for models that are not separable. Used by mor
// (impulse_space). Source: rational Krylov spaces for parametric sources; the number of shifts
// after Druskin, Knizhnerman and Zaslavsky, SIAM J. Sci. Comput. 31 (2009) 3760-3780: for a
// symmetric operator the error falls geometrically with the number of log-spaced real shifts.
// Units: SI.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/impulse_space.hpp"

namespace photocoag {

/// The projection on resolvent_basis(), to be diagonalised (mor/impulse_space.hpp).
BasisProducts resolvent_products(const FullOrderModel& model,
                                 const std::vector<AbsorptionFactors>& absorption_factors);

/// Columns span (s - A)^-1 B(alpha) for 28 shifts s log-spaced over [1, 1e7] 1/s and all
/// `absorption_factors`, orthonormal to about 1e-8; directions that add less than 1e-7 to a
/// snapshot are left out. A column is a radial x axial matrix in the model's coordinates. Each
/// system is tridiagonal in depth. Not for separable models. Allocates.
Eigen::MatrixXd resolvent_basis(const FullOrderModel& model,
                                const std::vector<AbsorptionFactors>& absorption_factors);

/// Orthonormal axial sources in whose span the source of every alpha lies, to 1e-7 of the largest:
/// columns; the coefficients of one source are its inner products with them. Few columns, as the
/// sources depend on alpha through few layers. Allocates.
Eigen::MatrixXd source_basis(const FullOrderModel& model,
                             const std::vector<AbsorptionFactors>& absorption_factors);

}  // namespace photocoag
