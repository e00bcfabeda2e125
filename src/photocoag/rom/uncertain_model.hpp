// Role: the interface between offline and online code for several unknown quantities; peak and
// volume responses as functions of them, on shared modes. Made by mor/uncertain_fit, used by
// estimation and mpc. Source: docs/uncertainty.md. Units: SI; the input is the commanded power, W.
// Real time: evaluate() and step_of() do not allocate. Threads: plain data.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/core/types.hpp"
#include "photocoag/rom/belief.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

using QuantityVector = BoundedVector<kMaxQuantities>;  // ln q, SI
using QuantityMatrix = BoundedMatrix<kMaxQuantities, kMaxQuantities>;
/// Row i, column q: derivative of residue i by ln of quantity q.
using ResidueSlopes = BoundedMatrix<kMaxOrder, kMaxQuantities>;

/// Product of Chebyshev polynomials: an earlier term times T_degree(x_quantity).
struct PolynomialTerm {
  int parent = 0;  ///< index of the earlier term; term 0 is the constant 1
  int quantity = 0;
  int degree = 0;
  bool operator==(const PolynomialTerm&) const = default;
};

inline constexpr int kMaxPolynomialTerms = 256;
inline constexpr int kMaxDegree = 6;

/// x_i' = -rate_i x_i + u,  y = sum_i R_i(q) x_i for y = peak, volume.
///
/// R_i(q) = prod_v q_v^g_v * sum_t coefficient_it psi_t(ln q): a power law times a polynomial
/// correction, psi_t products of Chebyshev polynomials on the box of the quantities. Transmission:
/// g = 1, no polynomial. The modes do not depend on the quantities, so the state is known from the
/// powers alone and all unknowns are in the outputs. Exact for an eye that does not change, up to
/// the fit error, which is measured.
struct UncertainModel {
  std::vector<UncertainQuantity> quantities;
  Tissue tissue;                      ///< values of everything that is not listed
  std::vector<double> rates;          ///< 1/s, descending
  std::vector<PolynomialTerm> terms;  ///< from term 1 on
  Eigen::MatrixXd peak;               ///< order x (terms + 1)
  Eigen::MatrixXd volume;
  std::vector<double> peak_exponents;  ///< g, one per quantity
  std::vector<double> volume_exponents;
  /// Mode i as a sample sees it: seen_before[i] times its value at the period's start plus
  /// seen_power[i] times the period's contribution. Empty: the mode at the period's end. Not in the
  /// file.
  std::vector<double> seen_before;
  std::vector<double> seen_power;
  double period = 0.0;  ///< s
  /// Fit error: root mean square and maximum over eyes drawn from the box and over the step
  /// response from one period on, relative to the eye's last value.
  double peak_error_rms = 0.0;
  double volume_error_rms = 0.0;
  double peak_error_max = 0.0;
  double volume_error_max = 0.0;

  int order() const noexcept { return static_cast<int>(rates.size()); }
  int count() const noexcept { return static_cast<int>(quantities.size()); }

  /// Residues at ln q and their derivatives by ln q; outside the box as at its edge. Without the
  /// calibration: both are of true temperatures.
  void evaluate(const QuantityVector& log_q, StateVector& peak_residue, ResidueSlopes& peak_slope,
                StateVector& volume_residue, ResidueSlopes& volume_slope) const noexcept;

  /// e^(-rate T) and (1 - e^(-rate T)) / rate: one period of constant power.
  void step_of(double period_s, StateVector& decay, StateVector& gain) const;

  /// A reduced model to set up the optimal control problem with, independent of its one parameter:
  /// C_peak = 1 in coordinates R_peak,i x_i; its input is passed in every cycle.
  ReducedModel control_model() const;
  /// ln q at the centre of the box.
  QuantityVector centre_of_box() const;

  /// Throws Error: sizes, finite numbers, decaying modes, and at the centre of the box a positive
  /// response after one period and for ever.
  void validate() const;
};

}  // namespace photocoag
