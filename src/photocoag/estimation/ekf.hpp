// Role: online; extended Kalman filter for state and absorption factor together. Used by loop.
// Source: paper, section 2 (extended dynamics); Joseph form: Bar-Shalom, Li and Kirubarajan,
// "Estimation with Applications to Tracking and Navigation" (2001), eq. 5.2.3-18; docs/equations.md
// (E14) to (E17). Differences: alpha has process noise and bounds; the state's process noise is an
// unknown power, so that no setting depends on the reduced state's scale: results are the same
// after x -> T x. Units: SI. Real time: predict and update are noexcept, bounded, allocation-free.
// Threads: one owner.
#pragma once

#include "photocoag/core/types.hpp"
#include "photocoag/estimation/outlier_gate.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/estimation/status.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// z = (x, alpha), P its covariance:
///   predict  x <- A x + B(alpha) u,  P <- F P F' + Q,  F = [A, B'(alpha) u; 0, 1],
///            Q = diag(s_u^2 B B', s_alpha^2)
///   update   H = [C(alpha), C'(alpha) x],  S = H P H' + s_y^2,  K = P H' / S,
///            z <- z + K (y - C x),  P <- (I - K H) P (I - K H)' + K s_y^2 K'
/// An alpha outside its bounds is moved to the bound and the state with it, along their covariance.
class ExtendedKalmanFilter {
 public:
  /// Starts at x = 0 (cold tissue, known exactly), alpha = absorption_initial. Throws Error on bad
  /// settings.
  ExtendedKalmanFilter(const ReducedModel& model, const EstimatorSettings& settings);

  void reset() noexcept;
  /// One period with `power`, W.
  void predict(double power) noexcept;
  /// With the volume temperature at the end of the period, K. NaN means no sample; so does a rise
  /// below -50 K or above 300 K, which no tissue can show. A sample that the outlier gate rejects
  /// is a prediction too (estimation/outlier_gate.hpp).
  UpdateStatus update(double volume_temperature) noexcept;

  const StateVector& state() const noexcept { return state_; }
  double absorption_factor() const noexcept { return alpha_; }
  double absorption_sigma() const noexcept;
  /// C_vol(alpha) x and C_peak x, K.
  Outputs outputs() const noexcept;
  /// Standard deviation of C_peak x, K.
  double peak_sigma() const noexcept;
  /// Innovation of the last update or rejected sample, K, and its standard deviation.
  double innovation() const noexcept { return innovation_; }
  double innovation_sigma() const noexcept { return innovation_sigma_; }
  /// Matrices at the current alpha.
  const ParametricMatrices& matrices() const noexcept { return matrices_; }
  /// Covariance of (x, alpha), order + 1 square.
  const BoundedMatrix<kMaxOrder + 1, kMaxOrder + 1>& covariance() const noexcept {
    return covariance_;
  }

 private:
  using Extended = BoundedVector<kMaxOrder + 1>;
  using ExtendedMatrix = BoundedMatrix<kMaxOrder + 1, kMaxOrder + 1>;

  void set_alpha(double alpha) noexcept;
  void keep_alpha_inside() noexcept;
  bool healthy() const noexcept;

  ReducedModel model_;
  EstimatorSettings settings_;
  int order_;
  StateVector state_;
  double alpha_ = 0.0;
  ExtendedMatrix covariance_;
  ParametricMatrices matrices_;
  OutlierGate gate_;
  double innovation_ = 0.0;
  double innovation_sigma_ = 0.0;
};

}  // namespace photocoag
