#include "photocoag/estimation/ekf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/core/check.hpp"

namespace photocoag {

void require_parameters(const ReducedModel& model, const EstimatorSettings& settings) {
  settings.validate();
  require(model.parameters >= settings.unknown_count(), "estimator.unknowns",
          std::string_view("\"rpe-and-choroid\""),
          "\"rpe\", or a model with both parameters: a [tissue] with a layer that has scaled_by = "
          "\"beta\"");
}

ExtendedKalmanFilter::ExtendedKalmanFilter(const ReducedModel& model,
                                           const EstimatorSettings& settings)
    : model_(model),
      settings_(settings),
      order_(model.order()),
      unknowns_(settings.unknown_count()),
      gate_(settings.outlier_sigma) {
  require_parameters(model, settings);
  reset();
}

void ExtendedKalmanFilter::reset() noexcept {
  state_.setZero(order_);
  covariance_.setZero(order_ + unknowns_, order_ + unknowns_);
  covariance_(order_, order_) =
      settings_.absorption_sigma_initial * settings_.absorption_sigma_initial;
  if (unknowns_ == 2) {
    covariance_(order_ + 1, order_ + 1) =
        settings_.choroid_sigma_initial * settings_.choroid_sigma_initial;
  }
  innovation_ = 0.0;
  innovation_sigma_ = 0.0;
  gate_.reset();
  parameters_ = {settings_.absorption_initial, settings_.choroid_initial};
  evaluate_at(model_, parameters_, matrices_);
}

template <int U>
void ExtendedKalmanFilter::predict_as(double power) noexcept {
  // F = [A, b; 0, 1] with b = B'(p) u, so that F P F' needs A P_xx A', A P_xp and P_pp only.
  SlopeMatrix b(order_, U);
  for (int q = 0; q < U; ++q) b.col(q) = input_slope(matrices_, q) * power;
  const StateVector next = model_.A_d.lazyProduct(state_) + matrices_.input * power;
  const double power_variance = settings_.power_process_noise * settings_.power_process_noise;
  predict_covariance<U>(model_.A_d, matrices_.input, b, power_variance, drift_variance(settings_),
                        covariance_);
  state_ = next;
}

void ExtendedKalmanFilter::predict(double power) noexcept {
  unknowns_ == 1 ? predict_as<1>(power) : predict_as<2>(power);
}

template <int U>
UpdateStatus ExtendedKalmanFilter::update_as(double volume_temperature) noexcept {
  const ExtendedVector h = measurement_row<U>(matrices_, state_);
  const double noise = settings_.measurement_noise * settings_.measurement_noise;
  const ExtendedVector ph = covariance_.lazyProduct(h);
  const double variance = h.dot(ph) + noise;
  innovation_ = volume_temperature - matrices_.volume.dot(state_);
  innovation_sigma_ = std::sqrt(variance);
  if (!gate_.passes(innovation_, innovation_sigma_)) return UpdateStatus::kOutlier;
  const ExtendedVector gain = ph / variance;
  update_covariance(h, ph, gain, noise, covariance_);
  state_ += gain.head(order_) * innovation_;
  for (int q = 0; q < U; ++q) parameters_[q] += gain[order_ + q] * innovation_;
  keep_parameters_inside();
  evaluate_at(model_, parameters_, matrices_);
  // Last, so that nothing after it can spoil the state: the move to a bound multiplies by a
  // quotient.
  if (!healthy()) {
    reset();
    return UpdateStatus::kRestarted;
  }
  return UpdateStatus::kUpdated;
}

UpdateStatus ExtendedKalmanFilter::update(double volume_temperature) noexcept {
  if (!possible_sample(volume_temperature)) return UpdateStatus::kNoSample;
  return unknowns_ == 1 ? update_as<1>(volume_temperature) : update_as<2>(volume_temperature);
}

void ExtendedKalmanFilter::keep_parameters_inside() noexcept {
  const int n = order_;
  if (unknowns_ == 1) {
    const double bounded =
        std::clamp(parameters_[0], settings_.absorption_min, settings_.absorption_max);
    if (bounded == parameters_[0]) return;
    const double variance = covariance_(n, n);
    if (variance > 0.0) {
      state_ += covariance_.col(n).head(n) * ((bounded - parameters_[0]) / variance);
    }
    parameters_[0] = bounded;
    return;
  }
  const double V[2][2] = {{covariance_(n, n), covariance_(n, n + 1)},
                          {covariance_(n + 1, n), covariance_(n + 1, n + 1)}};
  const BoxedParameters boxed = keep_inside(parameters_, V, 2, parameter_box(settings_));
  if (!boxed.moved) return;
  for (int q = 0; q < 2; ++q) state_ += covariance_.col(n + q).head(n) * boxed.multiplier[q];
  parameters_ = boxed.value;
}

bool ExtendedKalmanFilter::healthy() const noexcept {
  if (!std::isfinite(parameters_[0]) || !std::isfinite(parameters_[1])) return false;
  if (!state_.allFinite() || !covariance_.allFinite()) return false;
  const Outputs estimate = outputs();  // a finite state near the largest double has none
  if (!std::isfinite(estimate.volume) || !std::isfinite(estimate.peak)) return false;
  return (covariance_.diagonal().array() >= 0.0).all();
}

double ExtendedKalmanFilter::absorption_sigma() const noexcept {
  return std::sqrt(std::max(0.0, covariance_(order_, order_)));
}

double ExtendedKalmanFilter::choroid_sigma() const noexcept {
  return unknowns_ == 1 ? 0.0 : std::sqrt(std::max(0.0, covariance_(order_ + 1, order_ + 1)));
}

Outputs ExtendedKalmanFilter::outputs() const noexcept {
  return {.volume = matrices_.volume.dot(state_), .peak = model_.C_peak.dot(state_)};
}

double ExtendedKalmanFilter::peak_sigma() const noexcept {
  return extended_peak_sigma(model_.C_peak, covariance_);
}

}  // namespace photocoag
