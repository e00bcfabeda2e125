// Role: online; extended Kalman filter for state and absorption factors. Used by loop, study.
// Source: paper, section 2 (extended dynamics); Joseph form: Bar-Shalom, Li and Kirubarajan,
// "Estimation with Applications to Tracking and Navigation" (2001), eq. 5.2.3-18; docs/equations.md
// (E14) to (E17). Differences: alpha has process noise and bounds; optionally a second unknown
// (beta, the choroid's factor); the state's process noise is an unknown power, so that no setting
// depends on the reduced state's scale: results are invariant under x -> T x. Units: SI. Real time:
// predict and update are noexcept, bounded, allocation-free. Threads: one owner.
#pragma once

#include "photocoag/core/real_time.hpp"
#include "photocoag/estimation/extended_estimate.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/estimation/status.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// z = (x, p), p = alpha or (alpha, beta), P its covariance:
///   predict  x <- A x + B(p) u,  P <- F P F' + Q,  F = [A, B'(p) u; 0, 1],
///            Q = diag(s_u^2 B B', s_p^2)
///   update   H = [C(p), C'(p) x],  S = H P H' + s_y^2,  K = P H' / S,
///            z <- z + K (y - C x),  P <- (I - K H) P (I - K H)' + K s_y^2 K'
/// Parameters outside their bounds are moved to the most likely point inside, and the state moves
/// with them along the covariance.
class ExtendedKalmanFilter : public ExtendedEstimate {
 public:
  /// Starts at x = 0 (cold tissue, known exactly), p = its initial value. Throws Error on bad
  /// settings, or two unknowns for a model with one parameter.
  ExtendedKalmanFilter(const ReducedModel& model, const EstimatorSettings& settings);

  void reset() noexcept;
  /// One period with `power`, W.
  void predict(double power) noexcept PHOTOCOAG_NONBLOCKING;
  /// `volume_temperature`: K, at the end of the period. NaN, or a physically impossible value
  /// (below -50 K or above 300 K), counts as no sample. Without a sample, or with one that the
  /// outlier gate rejects (estimation/outlier_gate.hpp), the prediction stands.
  UpdateStatus update(double volume_temperature) noexcept PHOTOCOAG_NONBLOCKING;

 private:
  template <int U>
  UpdateStatus update_as(double volume_temperature) noexcept;
  void keep_parameters_inside() noexcept;
  bool healthy() const noexcept;
};

}  // namespace photocoag
