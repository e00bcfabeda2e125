// Role: offline and simulated eye; the heat equation on the grid, diagonalised. Used by mor, loop's
// full-order plant, `response`. Source: paper, section 2; docs/equations.md (E1) to (E6).
// Differences: finite volumes instead of finite differences; sign of the volume weight; cell
// averages of the source instead of point values. Units: SI; temperatures are rises over ambient.
// Threads: immutable after construction, may be shared.
#pragma once

#include <Eigen/Core>

#include "photocoag/core/outputs.hpp"
#include "photocoag/fom/grid.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// Eigenpairs of one direction of the heat operator on the grid.
///
/// The operator D = M^-1 K (K: two-point fluxes times diffusivity, M: cell measures) is symmetric
/// in the energy product, so M^(1/2) D M^(-1/2) = U diag(rates) U' with orthogonal U.
struct Modes {
  Eigen::VectorXd rates;         ///< 1/s, ascending, all positive
  Eigen::MatrixXd vectors;       ///< U, cells x modes
  Eigen::VectorXd root_measure;  ///< M^(1/2): sqrt of ring area (m2) or of thickness (m)

  Eigen::Index size() const noexcept { return rates.size(); }
  /// U' M^(-1/2) v: coordinates of a functional given by its values per cell.
  Eigen::VectorXd project_functional(const Eigen::VectorXd& per_cell) const;
  /// M^(-1/2) U x: cell values of a field given by its coordinates.
  Eigen::VectorXd to_cells(const Eigen::VectorXd& coordinates) const;
};

/// What turns the two axial profiles of a ModalStepper into outputs, for one alpha.
struct OutputWeights {
  Eigen::VectorXd peak;    ///< one per axial mode
  Eigen::VectorXd volume;  ///< one per axial mode
};

/// x' = A x + B(alpha) u with n = grid cells, in the coordinates of the radial and axial modes:
/// A is diagonal with entries -(radial rate i + axial rate j), B(alpha) = beam_i * source_j(alpha).
class FullOrderModel {
 public:
  /// Builds grid, operator and output functionals. Throws Error on bad settings. Allocates.
  FullOrderModel(const Tissue& tissue, const GridSettings& settings);
  FullOrderModel(const Tissue& tissue, Grid grid);

  const Tissue& tissue() const noexcept { return tissue_; }
  const Grid& grid() const noexcept { return grid_; }
  std::size_t states() const noexcept { return grid_.cells(); }
  const Modes& radial() const noexcept { return radial_; }
  const Modes& axial() const noexcept { return axial_; }

  /// Radial coordinates of the beam, 1/m: the flat-top 1/(pi R_I^2) inside the spot. The area mean
  /// over the spot has the same coordinates, which makes the volume output the input's adjoint.
  const Eigen::VectorXd& beam() const noexcept { return beam_; }
  /// Radial and axial coordinates of the evaluation at (r = 0, z = z_center).
  const Eigen::VectorXd& peak_radial() const noexcept { return peak_radial_; }
  const Eigen::VectorXd& peak_axial() const noexcept { return peak_axial_; }

  /// Absorbed fraction of each axial cell: s_j(alpha) of (E3), exact cell integrals.
  const std::vector<AbsorbedFraction>& cell_absorption() const noexcept { return cell_absorption_; }
  /// Axial coordinates of the source: U' M^(-1/2) s(alpha). Allocates.
  Eigen::VectorXd axial_source(double alpha) const;
  /// Coordinates of any per-cell absorbed fractions.
  Eigen::VectorXd axial_source(const Eigen::VectorXd& absorbed_per_cell) const;

  /// Weights for a stepper's profiles: (E5), (E6) for this alpha, commanded power in W. Allocates.
  OutputWeights output_weights(double alpha) const;
  /// transmission / (rho C_p), K m3/J: from commanded power to heating.
  double input_gain() const noexcept;

 private:
  Tissue tissue_;
  Grid grid_;
  Modes radial_;
  Modes axial_;
  Eigen::VectorXd beam_;
  Eigen::VectorXd peak_radial_;
  Eigen::VectorXd peak_axial_;
  std::vector<AbsorbedFraction> cell_absorption_;
  AbsorbedFraction whole_absorption_;
};

}  // namespace photocoag
