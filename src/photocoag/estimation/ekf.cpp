#include "photocoag/estimation/ekf.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {

ExtendedKalmanFilter::ExtendedKalmanFilter(const ReducedModel& model,
                                           const EstimatorSettings& settings)
    : ExtendedEstimate(model, settings) {
  reset();
}

void ExtendedKalmanFilter::reset() noexcept { reset_estimate(); }

void ExtendedKalmanFilter::predict(double power) noexcept {
  unknowns_ == 1 ? predict_estimate<1>(power) : predict_estimate<2>(power);
}

template <int U>
UpdateStatus ExtendedKalmanFilter::update_as(double volume_temperature) noexcept {
  const ExtendedVector h = measurement_row<U>(matrices_, state_);
  const double noise = sample_variance();
  const ExtendedVector ph = product(covariance_, h);
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
  // Last, because moving to a bound multiplies by a quotient, which may not be finite.
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
  return finite_estimate() && (covariance_.diagonal().array() >= 0.0).all();
}

}  // namespace photocoag
