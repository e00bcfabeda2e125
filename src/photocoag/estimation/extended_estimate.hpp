// Role: online; common part of the estimators of (x, alpha[, beta]): model, settings, estimate and
// its accessors. Used by ekf and mhe. Source: docs/equations.md (E14), (E15). Units: SI. Real time:
// noexcept, bounded, allocation-free after construction. Threads: one owner.
#pragma once

#include "photocoag/core/outputs.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/estimation/extended_system.hpp"
#include "photocoag/estimation/outlier_gate.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// An implementation base, not an interface: nothing is virtual, AnyEstimator chooses.
class ExtendedEstimate {
 public:
  const StateVector& state() const noexcept { return state_; }
  double absorption_factor() const noexcept { return parameters_[0]; }
  double absorption_sigma() const noexcept;
  /// beta; if not estimated its constant value, with sigma 0.
  double choroid_factor() const noexcept { return parameters_[1]; }
  double choroid_sigma() const noexcept;
  /// C_vol(p) x and C_peak x, K.
  Outputs outputs() const noexcept;
  /// Standard deviation of C_peak x, K.
  double peak_sigma() const noexcept;
  /// Innovation of the last update or rejected sample, K, and its standard deviation.
  double innovation() const noexcept { return innovation_; }
  double innovation_sigma() const noexcept { return innovation_sigma_; }
  /// Matrices at the current parameters.
  const ParametricMatrices& matrices() const noexcept { return matrices_; }
  /// Covariance of (x, p), (order + unknowns) square.
  const ExtendedMatrix& covariance() const noexcept { return covariance_; }

 protected:
  /// Throws Error on bad settings, or more unknowns than the model has parameters. The estimate is
  /// set by reset_estimate().
  ExtendedEstimate(const ReducedModel& model, const EstimatorSettings& settings);

  /// x = 0 (cold tissue, known exactly), p = its initial value.
  void reset_estimate() noexcept;
  /// x <- A x + B(p) u,  P <- F P F' + Q. U = unknowns.
  template <int U>
  void predict_estimate(double power) noexcept {
    SlopeMatrix b(order_, U);
    for (int q = 0; q < U; ++q) b.col(q) = matrices_.input_slope[q] * power;
    predict_covariance<U>(model_.A_d, decay_, matrices_.input, b, unknown_power_variance(),
                          drift_variance(settings_), covariance_);
    state_ = (next_free_state(model_.A_d, decay_, state_) + matrices_.input * power).eval();
  }
  /// Checks the outputs too: a finite state near the largest double has infinite outputs.
  bool finite_estimate() const noexcept;
  double unknown_power_variance() const noexcept {
    return settings_.power_process_noise * settings_.power_process_noise;
  }
  double sample_variance() const noexcept {
    return settings_.measurement_noise * settings_.measurement_noise;
  }

  ReducedModel model_;
  StateVector decay_;  // the diagonal of A_d if A_d is diagonal, else empty
  EstimatorSettings settings_;
  int order_;
  int unknowns_;
  StateVector state_;
  Parameters parameters_{};
  ExtendedMatrix covariance_;
  ParametricMatrices matrices_;
  OutlierGate gate_;
  double innovation_ = 0.0;
  double innovation_sigma_ = 0.0;
};

}  // namespace photocoag
