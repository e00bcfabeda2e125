// Role: offline and simulated eye; the heat equation on the grid, diagonalised as far as it is
// separable. Used by mor, the full-order eyes, population, fmu, `response`. Source: paper, section
// 2; docs/equations.md (E1) to (E6); perfusion: Pennes, J. Appl. Physiol. 1 (1948) 93-122.
// Differences: finite volumes instead of finite differences; sign of the volume weight; cell
// averages of the source instead of point values; thermal data per layer, perfusion, other beams
// than the flat top. Units: SI; temperatures are rises over ambient.
// Threads: immutable after construction, may be shared.
#pragma once

#include <Eigen/Core>

#include "photocoag/core/outputs.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/fom/grid.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// Eigenpairs of one direction of the heat operator on the grid.
///
/// The operator D = M^-1 K (K: two-point fluxes times diffusivity, M: cell measures) is symmetric
/// in the energy product, so M^(1/2) D M^(-1/2) = U diag(rates) U' with orthogonal U.
struct Modes {
  Eigen::VectorXd rates;         ///< 1/s, ascending, all positive; radially 1/m2 if not separable
  Eigen::MatrixXd vectors;       ///< U, cells x modes; empty: the identity
  Eigen::VectorXd root_measure;  ///< M^(1/2): sqrt of ring area (m2) or of thickness (m)

  Eigen::Index size() const noexcept { return root_measure.size(); }
  /// U' M^(-1/2) v: coordinates of a functional given by its values per cell.
  Eigen::VectorXd project_functional(const Eigen::VectorXd& per_cell) const;
  /// M^(-1/2) U x: cell values of a field given by its coordinates.
  Eigen::VectorXd to_cells(const Eigen::VectorXd& coordinates) const;
};

/// Weights that turn the two axial profiles of a ModalStepper into outputs, for one alpha.
struct OutputWeights {
  Eigen::VectorXd peak;    ///< one per axial mode
  Eigen::VectorXd volume;  ///< one per axial mode
};

/// The heat operator in depth where conductivity or heat capacity change from layer to layer. With
/// C = rho C_p dz, K = k dz, W = perfusion dz and T the two-point fluxes (harmonic mean of k at a
/// face between two layers), radial mode i of eigenvalue l_i, 1/m2, obeys
///   C x' = -(l_i K + T + W) x + source,
/// in coordinates C^(1/2) x the symmetric tridiagonal S_i = l_i diag(diffusivity) + S_0.
struct DepthOperator {
  Eigen::VectorXd diffusivity;   ///< m2/s, k / (rho C_p) of each cell
  Eigen::VectorXd diagonal;      ///< 1/s, of S_0
  Eigen::VectorXd off_diagonal;  ///< 1/s, of S_0; between cells j and j + 1
};

/// x' = A x + B(alpha) u with n = grid cells.
///
/// Separable (all layers conduct and store heat alike; perfusion per layer is no obstacle): in the
/// coordinates of radial and axial modes A is diagonal with entries -(radial rate i + axial rate
/// j).
/// Otherwise: radial modes of the pure Laplacian, and in depth the cells themselves (axial()
/// has empty `vectors` and `rates`, root_measure = (rho C_p dz)^(1/2)); radial mode i has
/// A = -(radial rate i * diag(diffusivity) + S_0), see depth_operator().
/// Either way B(alpha) = input_gain * beam_i * source_j(alpha), and A is symmetric.
class FullOrderModel {
 public:
  /// Builds grid, operator and output functionals. Throws Error on bad settings. Allocates.
  FullOrderModel(const Tissue& tissue, const GridSettings& settings);
  FullOrderModel(const Tissue& tissue, Grid grid);
  /// Another tissue on the grid of `standing`, whose modes are reused. Absorption, layer
  /// boundaries, beam and a common conductivity may differ, the outer dimensions may not. Layer
  /// boundaries need not lie on faces: sources are integrated over the cells. Takes 0.3 ms instead
  /// of 0.1 s for a diagonalisation. Both must be separable and without perfusion. Throws Error.
  FullOrderModel(const FullOrderModel& standing, const Tissue& tissue);

  const Tissue& tissue() const noexcept { return tissue_; }
  const Grid& grid() const noexcept { return grid_; }
  std::size_t states() const noexcept { return grid_.cells(); }
  const Modes& radial() const noexcept { return radial_; }
  const Modes& axial() const noexcept { return axial_; }
  bool separable() const noexcept { return separable_; }
  /// Empty if separable.
  const DepthOperator& depth_operator() const noexcept { return depth_operator_; }

  /// Radial coordinates of the beam, 1/m: of the normalised irradiance (tissue/beam.hpp). The mean
  /// weighted with it has the same coordinates, which makes the volume output the input's adjoint.
  const Eigen::VectorXd& beam() const noexcept { return beam_; }
  /// Radial and axial coordinates of the evaluation at (r = 0, z = z_center).
  const Eigen::VectorXd& peak_radial() const noexcept { return peak_radial_; }
  const Eigen::VectorXd& peak_axial() const noexcept { return peak_axial_; }

  /// Absorbed fraction of each axial cell: s_j(alpha) of (E3), exact cell integrals.
  const std::vector<AbsorbedFraction>& cell_absorption() const noexcept { return cell_absorption_; }
  /// Axial coordinates of the source: U' M^(-1/2) s(alpha, beta). Allocates.
  Eigen::VectorXd axial_source(AbsorptionFactors at) const;
  /// Coordinates of any per-cell absorbed fractions.
  Eigen::VectorXd axial_source(const Eigen::VectorXd& absorbed_per_cell) const;

  /// Weights for a stepper's profiles at these factors, commanded power in W: (E5), (E6).
  /// Allocates.
  OutputWeights output_weights(AbsorptionFactors at) const;
  /// From commanded power to heating rate: transmission / (rho C_p), K m3/J, if separable;
  /// otherwise transmission, since the axial coordinates hold rho C_p.
  double input_gain() const noexcept { return input_gain_; }
  /// What the volume output's weight is divided by: 1, or the absorbed fraction if normalised.
  double volume_norm(AbsorptionFactors at) const noexcept;

 private:
  // Sources, outputs and beam of tissue_ on the grid and its modes.
  void set_absorption_and_beam();

  Tissue tissue_;
  Grid grid_;
  Modes radial_;
  Modes axial_;
  DepthOperator depth_operator_;
  bool separable_;
  double input_gain_ = 0.0;
  Eigen::VectorXd beam_;
  Eigen::VectorXd peak_radial_;
  Eigen::VectorXd peak_axial_;
  std::vector<AbsorbedFraction> cell_absorption_;
  AbsorbedFraction whole_absorption_;
};

}  // namespace photocoag
