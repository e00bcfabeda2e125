// Role: the waist for several unknown quantities; peak and volume responses over all of them on
// modes that they share. Made by mor/uncertain_fit, used by estimation and mpc. Source:
// docs/uncertainty.md. Units: SI; the input is the commanded power, W. Real time: evaluate() and
// the like are noexcept and allocate nothing. Threads: plain data.
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

/// Product of Chebyshev polynomials: that of an earlier term times T_degree(x_quantity).
struct PolynomialTerm {
  int parent = 0;  ///< the term 0 is 1
  int quantity = 0;
  int degree = 0;
  bool operator==(const PolynomialTerm&) const = default;
};

inline constexpr int kMaxPolynomialTerms = 256;
inline constexpr int kMaxDegree = 6;

/// x_i' = -rate_i x_i + u,  y = sum_i R_i(q) x_i for y = peak, volume.
///
/// R_i(q) = prod_v q_v^g_v * sum_t coefficient_it psi_t(ln q): a power law, and psi_t products of
/// Chebyshev polynomials on the box of the quantities for what differs from it. Transmission: g =
/// 1, no polynomial. The modes depend on nothing, so that the state is known from the powers alone
/// and all that is unknown stands in the outputs. Exact for one eye that does not change; what the
/// fit costs is measured.
struct UncertainModel {
  std::vector<UncertainQuantity> quantities;
  Tissue tissue;                      ///< the quantities that are not listed
  std::vector<double> rates;          ///< 1/s, descending
  std::vector<PolynomialTerm> terms;  ///< from term 1 on
  Eigen::MatrixXd peak;               ///< order x (terms + 1)
  Eigen::MatrixXd volume;
  std::vector<double> peak_exponents;  ///< g, one per quantity
  std::vector<double> volume_exponents;
  /// What a sample shows of mode i: before_i times its value at the period's start, power_i times
  /// what the period adds to it. Empty: the mode at the period's end. Not in the file.
  std::vector<double> seen_before;
  std::vector<double> seen_power;
  double period = 0.0;  ///< s
  /// Root mean square over eyes drawn from the box and over the step response from one period on,
  /// relative to the eye's last value; and the largest.
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

  /// The response of one eye as a reduced model of one parameter that plays no part: C_peak = 1 in
  /// coordinates R_peak,i x_i. What the optimal control problem is set up with; its input is given
  /// in every cycle.
  ReducedModel control_model() const;
  /// ln q in the middle of every range.
  QuantityVector centre_of_box() const;

  /// Throws Error: sizes, finite numbers, decaying modes, and at the centre of the box a positive
  /// response after one period and for ever.
  void validate() const;
};

}  // namespace photocoag
