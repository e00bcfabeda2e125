#include "photocoag/safety/witness.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {
namespace {

constexpr double kMemory = 0.95;      // of the misfit: 20 samples count
constexpr double kPlausible = 12.0;   // 3.5 standard deviations of one parameter
constexpr double kLeastNoise = 0.02;  // K: a noise-free simulated eye has a model error still

double dot(const WitnessModel::Weights& weights,
           const std::array<double, kWitnessModes>& lag) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < kWitnessModes; ++i) sum += weights[i] * lag[i];
  return sum;
}

}  // namespace

Witness::Witness(const WitnessModel& model, double noise, double model_error) noexcept
    : model_(model),
      noise_variance_(std::max(noise, kLeastNoise) * std::max(noise, kLeastNoise)),
      model_error_(model_error) {
  for (std::size_t i = 0; i < kWitnessModes; ++i) {
    held_1_[i] = 1.0;
    held_2_[i] = 1.0 + model_.decay[i];
  }
  doubt();
}

void Witness::doubt() noexcept {
  misfit_.fill(0.0);
  find_plausible();
}

void Witness::emit(double power) noexcept {
  Lags seen{};
  for (std::size_t i = 0; i < kWitnessModes && model_.averaged; ++i) {
    seen[i] = model_.seen_before[i] * lag_[i] + model_.seen_power[i] * power;
  }
  for (std::size_t i = 0; i < kWitnessModes; ++i) {
    lag_[i] = model_.decay[i] * lag_[i] + power;
    coasting_[i] = model_.decay[i] * lag_[i];
    coasting_2_[i] = model_.decay[i] * coasting_[i];
  }
  for (std::size_t j = 0; j < kWitnessAbsorptions; ++j) {
    volume_now_[j] = dot(model_.volume[j], model_.averaged ? seen : lag_);
  }
}

double Witness::variance(std::size_t j) const noexcept {
  const double error = model_error_ * volume_now_[j];
  return noise_variance_ + error * error;
}

WitnessResidual Witness::compare(double volume_temperature) const noexcept {
  // The volume temperature grows with alpha wherever light is still arriving; min and max also
  // serve where it does not.
  const auto [least, most] =
      std::minmax_element(volume_now_.begin() + static_cast<std::ptrdiff_t>(low_),
                          volume_now_.begin() + static_cast<std::ptrdiff_t>(high_) + 1);
  const double sigma = std::sqrt(variance(high_));
  const double beyond =
      std::max({0.0, *least - volume_temperature, volume_temperature - *most}) / sigma;
  return {.outside = beyond,
          .fit = (volume_temperature - volume_now_[best_]) / std::sqrt(variance(best_))};
}

void Witness::learn(double volume_temperature) noexcept {
  for (std::size_t j = 0; j < kWitnessAbsorptions; ++j) {
    const double residual = volume_temperature - volume_now_[j];
    misfit_[j] = kMemory * misfit_[j] + residual * residual / variance(j);
  }
  find_plausible();
}

void Witness::find_plausible() noexcept {
  best_ =
      static_cast<std::size_t>(std::min_element(misfit_.begin(), misfit_.end()) - misfit_.begin());
  const double bar = misfit_[best_] + kPlausible;
  low_ = best_;
  while (low_ > 0 && misfit_[low_ - 1] <= bar) --low_;
  std::size_t inside = best_;
  while (inside + 1 < kWitnessAbsorptions && misfit_[inside + 1] <= bar) ++inside;
  if (inside + 1 == kWitnessAbsorptions) {
    high_ = inside;
    high_fraction_ = 1.0;
  } else {
    high_ = inside + 1;
    high_fraction_ = (bar - misfit_[inside]) / (misfit_[high_] - misfit_[inside]);
  }
  high_alpha_ = model_.absorption[high_ - 1] +
                high_fraction_ * (model_.absorption[high_] - model_.absorption[high_ - 1]);
}

double Witness::at_high(double below, double above) const noexcept {
  return below + high_fraction_ * (above - below);
}

double Witness::peak_at_high(const Lags& lags) const noexcept {
  return at_high(dot(model_.peak[high_ - 1], lags), dot(model_.peak[high_], lags));
}

double Witness::power_for_peak(double peak) const noexcept {
  return std::max(0.0, (peak - peak_at_high(coasting_)) / peak_at_high(held_1_));
}

double Witness::held_power_for_peak(double peak) const noexcept {
  return std::max(0.0, (peak - peak_at_high(coasting_2_)) / peak_at_high(held_2_));
}

double Witness::steady_power(double peak) const noexcept {
  return peak / at_high(model_.steady_peak[high_ - 1], model_.steady_peak[high_]);
}

}  // namespace photocoag
