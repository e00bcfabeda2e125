// Role: online; moving horizon estimator for state and absorption factors. Used by loop.
// Source: Rao, Rawlings and Mayne, IEEE Trans. Autom. Control 48 (2003) 246-258; bounded
// Gauss-Newton as in Kleyman et al., arXiv 2103.03189 (group's MHE); docs/equations.md (E26),
// (E27). Differences: the unknown power of every period is part of the problem, eliminated exactly;
// the step is taken in measurement space, so that a singular arrival covariance (cold tissue) is no
// special case. Units: SI. Real time: predict and update are noexcept, allocation-free, bounded:
// at most kMaxIterations linearizations of a window of at most kMaxWindow samples. Threads: one
// owner.
#pragma once

#include <array>

#include "photocoag/core/types.hpp"
#include "photocoag/estimation/extended_estimate.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/estimation/status.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Over the last m <= window periods, with p = alpha or (alpha, beta) constant in the window:
///   min (z_0 - zbar)' P^-1 (z_0 - zbar) + sum w_j^2 / s_u^2 + sum (y_j - C(p) x_j)^2 / s_y^2
///   over z_0 = (x_0, p), w_1 … w_m, with x_j = A x_(j-1) + B(p) u_j + B w_j and p in its bounds.
/// The unknown power enters through B at the last estimate of p. With B(p) w_j a larger alpha would
/// explain the same error with less unknown power, so alpha would drift up in the dark. (zbar, P),
/// the arrival cost, comes from an extended Kalman filter over all older samples, linearized at
/// this problem's estimates. In the linear case the estimate equals the Kalman filter's.
class MovingHorizonEstimator : public ExtendedEstimate {
 public:
  static constexpr int kMaxIterations = 4;

  /// Starts and throws as ExtendedKalmanFilter.
  MovingHorizonEstimator(const ReducedModel& model, const EstimatorSettings& settings);

  void reset() noexcept;
  /// One period with `power`, W.
  void predict(double power) noexcept;
  /// As ExtendedKalmanFilter::update.
  UpdateStatus update(double volume_temperature) noexcept;

  /// Gauss-Newton steps of the last update.
  int iterations() const noexcept { return iterations_; }
  /// Periods in the window now.
  int periods() const noexcept { return periods_; }
  /// Gradient of the volume temperature at the end of period j (0 … periods() - 1) with respect to
  /// (x_0, p) at the current estimate; for tests.
  ExtendedVector measurement_gradient(int j) const noexcept;
  /// The volume temperature at the end of period j for the window's start at z_0 with the current
  /// estimates of w; for tests.
  double predicted_volume(const ExtendedVector& start, int j) const noexcept;
  /// (x_0, p) now.
  ExtendedVector start() const noexcept;

 private:
  using WindowVector = std::array<double, kMaxWindow>;

  struct Linearization;

  template <int U>
  void predict_as(double power) noexcept;
  template <int U>
  UpdateStatus update_as(double volume_temperature) noexcept;
  template <int U>
  void absorb_oldest() noexcept;
  void linearize(Linearization& at) const noexcept;
  double step(Linearization& at) noexcept;
  void finish(const Linearization& at) noexcept;
  bool healthy() const noexcept;

  // The window: power, sample (NaN: none) and unknown power of each period.
  int periods_ = 0;
  WindowVector power_{};
  WindowVector sample_{};
  WindowVector unknown_power_{};
  StateMatrix transition_;  // A^periods

  // Arrival cost and estimate at the window's start; the ExtendedEstimate is that at its end.
  ExtendedVector prior_mean_;
  ExtendedMatrix prior_covariance_;
  StateVector start_state_;

  int iterations_ = 0;
};

}  // namespace photocoag
