// Role: online; the peak limit as a chance constraint on the whole treatment. Used by loop when
// `control.robust` is "chance". Source: docs/uncertainty.md (how the treatment's probability
// becomes that of a cycle, what is assumed). Units: SI. Real time: tighten() is noexcept, bounded
// and allocation-free. Threads: one owner.
#pragma once

#include "photocoag/mpc/ocp.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

/// The estimator's knowledge of the eye when a power is chosen.
struct UncertainState {
  const StateVector& modes;          ///< x_i at the start of stage 0, W s
  const StateVector& peak_residue;   ///< R_peak
  const ResidueSlopes& peak_slope;   ///< dR_peak / d ln q
  const QuantityMatrix& covariance;  ///< of ln q
};

/// ln y_k ~ N(ln of the estimate, s_k^2): y_k <= y_max e^(-kappa s_k), k = 1 … N-1.
///
/// s_k^2 = g' P g + e^2, g = (dR' x_k) / (R' x_k), x_k the modes that `powers` lead to, e the rms
/// error of the model.
class ChanceLimit {
 public:
  /// Throws Error if the settings are bad.
  ChanceLimit(const UncertainModel& model, const ControlSettings& settings);

  /// Back-off from the limit in standard deviations.
  double kappa() const noexcept { return kappa_; }

  /// `input`: of the control problem, order entries. `powers`: W, at stages 0 … N-2, at which s_k
  /// is evaluated. Valid until the next call.
  const LimitTightening& tighten(const UncertainState& now, const StateVector& input,
                                 const InputVector& powers) noexcept;

  /// s_1 of the last call: relative standard deviation of the next peak.
  double relative_sigma() const noexcept { return relative_sigma_; }

  /// Largest change of a stage's limit by the last call, K.
  double change() const noexcept { return change_; }

 private:
  double kappa_;
  double peak_max_;
  double model_error_;
  int stages_;
  StateVector decay_;
  StateVector gain_;
  StateVector x_;
  double relative_sigma_ = 0.0;
  double change_ = 0.0;
  LimitTightening tightening_;
};

/// kappa of (U3) for `control.limit_probability`.
double kept_deviations(double limit_probability) noexcept;

/// One-sided normal quantile kappa: Phi(-kappa) = probability.
double normal_quantile(double probability) noexcept;

}  // namespace photocoag
