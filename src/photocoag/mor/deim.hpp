// Role: offline; discrete empirical interpolation of a parametric vector. Used by mor.
// Source: Chaturantabut and Sorensen, SIAM J. Sci. Comput. 32 (2010) 2737-2764, Algorithm 1;
// Q-DEIM: Drmac and Gugercin, SIAM J. Sci. Comput. 38 (2016) A631-A648.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/core/types.hpp"

namespace photocoag {

/// s(alpha) ~ interpolation * s(alpha)[dofs]: exact at the dofs.
struct Deim {
  std::vector<Eigen::Index> dofs;  ///< interpolation dofs, in the order in which they were chosen
  Eigen::MatrixXd interpolation;   ///< U (P'U)^-1, rows of a snapshot x dofs
};

/// Collateral basis: at most `max_terms` left singular vectors of `snapshots` (one column per
/// alpha), fewer if the singular values drop below 1e-12 of the first; dofs chosen greedily. Throws
/// Error if the snapshots are zero.
Deim deim(const Eigen::MatrixXd& snapshots, int max_terms);

/// The same basis, dofs by a QR factorisation of its transpose with column pivoting: independent of
/// the basis chosen for the span, and with a better bound on the interpolation's norm.
Deim q_deim(const Eigen::MatrixXd& snapshots, int max_terms);

}  // namespace photocoag
