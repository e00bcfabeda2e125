// Role: offline; the full-order model as sparse matrices over the cells, for use with other
// solvers: `export`, the Python package, benchmarks. Source: docs/equations.md (E4): the same
// two-point fluxes, assembled cell by cell. Units: SI.
#pragma once

#include <Eigen/SparseCore>

#include "photocoag/fom/full_order_model.hpp"

namespace photocoag {

/// E T' = A T + E b(alpha) u,  peak = c_peak T,  volume = c_volume(alpha) T.
/// T: temperature rise per cell, K; radial index runs fastest. E: ring volumes, m3, diagonal. A:
/// symmetric, negative definite, m3/s.
struct SparseSystem {
  Eigen::VectorXd E;
  Eigen::SparseMatrix<double> A;
};

/// Allocates.
SparseSystem assemble_sparse_system(const FullOrderModel& model);

/// b(alpha): K/s per watt of commanded power. Allocates.
Eigen::VectorXd input_of_cells(const FullOrderModel& model, AbsorptionFactors at);
/// c_peak: K per K of each cell.
Eigen::VectorXd peak_of_cells(const FullOrderModel& model);
/// c_volume(alpha), (E6).
Eigen::VectorXd volume_of_cells(const FullOrderModel& model, AbsorptionFactors at);

}  // namespace photocoag
