#include "photocoag/estimation/ekf.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {
ExtendedKalmanFilter::ExtendedKalmanFilter(const ReducedModel& model,
                                           const EstimatorSettings& settings)
    : model_(model), settings_(settings), order_(model.order()), gate_(settings.outlier_sigma) {
  settings.validate();
  reset();
}

void ExtendedKalmanFilter::reset() noexcept {
  state_.setZero(order_);
  covariance_.setZero(order_ + 1, order_ + 1);
  covariance_(order_, order_) =
      settings_.absorption_sigma_initial * settings_.absorption_sigma_initial;
  innovation_ = 0.0;
  innovation_sigma_ = 0.0;
  gate_.reset();
  set_alpha(settings_.absorption_initial);
}

void ExtendedKalmanFilter::set_alpha(double alpha) noexcept {
  alpha_ = alpha;
  model_.evaluate(alpha, matrices_);
}

void ExtendedKalmanFilter::predict(double power) noexcept {
  const int n = order_;
  // F = [A, b; 0, 1] with b = B'(alpha) u, so that F P F' needs A P_xx A', A P_xa and P_aa only.
  const StateVector b = matrices_.input_slope * power;
  const StateVector next = model_.A_d.lazyProduct(state_) + matrices_.input * power;
  const StateMatrix half = model_.A_d.lazyProduct(covariance_.topLeftCorner(n, n));
  const StateMatrix full = half.lazyProduct(model_.A_d.transpose());
  const StateVector cross = model_.A_d.lazyProduct(covariance_.col(n).head(n));
  const double variance = covariance_(n, n);
  const double power_variance = settings_.power_process_noise * settings_.power_process_noise;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) {
      const double symmetric = 0.5 * (full(i, j) + full(j, i)) + cross[i] * b[j] + b[i] * cross[j] +
                               variance * b[i] * b[j] +
                               power_variance * matrices_.input[i] * matrices_.input[j];
      covariance_(i, j) = symmetric;
      covariance_(j, i) = symmetric;
    }
  }
  for (int i = 0; i < n; ++i) {
    covariance_(i, n) = covariance_(n, i) = cross[i] + b[i] * variance;
  }
  covariance_(n, n) =
      variance + settings_.absorption_process_noise * settings_.absorption_process_noise;
  state_ = next;
}

UpdateStatus ExtendedKalmanFilter::update(double volume_temperature) noexcept {
  if (!possible_sample(volume_temperature)) return UpdateStatus::kNoSample;
  const int n = order_;
  Extended h(n + 1);
  h.head(n) = matrices_.volume;
  h[n] = matrices_.volume_slope.dot(state_);
  const double noise = settings_.measurement_noise * settings_.measurement_noise;
  const Extended ph = covariance_.lazyProduct(h);
  const double variance = h.dot(ph) + noise;
  innovation_ = volume_temperature - matrices_.volume.dot(state_);
  innovation_sigma_ = std::sqrt(variance);
  if (!gate_.passes(innovation_, innovation_sigma_)) return UpdateStatus::kOutlier;
  const Extended gain = ph / variance;

  // Joseph form as two rank-one steps: T = (I - K H) P, then P = T (I - K H)' + K noise K'.
  const ExtendedMatrix left = covariance_ - gain.lazyProduct(ph.transpose());
  const Extended left_h = left.lazyProduct(h);
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= j; ++i) {
      const double upper = left(i, j) - left_h[i] * gain[j];
      const double lower = left(j, i) - left_h[j] * gain[i];
      covariance_(i, j) = covariance_(j, i) = 0.5 * (upper + lower) + noise * gain[i] * gain[j];
    }
  }
  state_ += gain.head(n) * innovation_;
  set_alpha(alpha_ + gain[n] * innovation_);
  keep_alpha_inside();
  // Last, so that nothing after it can spoil the state: the move to a bound multiplies by a
  // quotient.
  if (!healthy()) {
    reset();
    return UpdateStatus::kRestarted;
  }
  return UpdateStatus::kUpdated;
}

void ExtendedKalmanFilter::keep_alpha_inside() noexcept {
  const double bounded = std::clamp(alpha_, settings_.absorption_min, settings_.absorption_max);
  if (bounded == alpha_) return;
  const double variance = covariance_(order_, order_);
  if (variance > 0.0) {
    state_ += covariance_.col(order_).head(order_) * ((bounded - alpha_) / variance);
  }
  set_alpha(bounded);
}

bool ExtendedKalmanFilter::healthy() const noexcept {
  if (!std::isfinite(alpha_) || !state_.allFinite() || !covariance_.allFinite()) return false;
  const Outputs estimate = outputs();  // a finite state near the largest double has none
  if (!std::isfinite(estimate.volume) || !std::isfinite(estimate.peak)) return false;
  return (covariance_.diagonal().array() >= 0.0).all();
}

double ExtendedKalmanFilter::absorption_sigma() const noexcept {
  return std::sqrt(std::max(0.0, covariance_(order_, order_)));
}

Outputs ExtendedKalmanFilter::outputs() const noexcept {
  return {.volume = matrices_.volume.dot(state_), .peak = model_.C_peak.dot(state_)};
}

double ExtendedKalmanFilter::peak_sigma() const noexcept {
  double variance = 0.0;
  for (int j = 0; j < order_; ++j) {
    for (int i = 0; i < order_; ++i) {
      variance += model_.C_peak[i] * covariance_(i, j) * model_.C_peak[j];
    }
  }
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace photocoag
