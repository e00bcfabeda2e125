#include "photocoag/safety/witness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace photocoag {
namespace {

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
  for (PerCurve& misfit : misfit_) misfit.fill(0.0);
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
  for (std::size_t j = 0; j < curves(); ++j) {
    volume_now_[j] = model_.averaged ? dot(model_.volume[j], seen) + model_.seen_feed[j] * power
                                     : dot(model_.volume[j], lag_);
  }
}

void Witness::await(double power) noexcept {
  for (std::size_t i = 0; i < kWitnessModes; ++i) {
    coasting_[i] = model_.decay[i] * (coasting_[i] + power);
    coasting_2_[i] = model_.decay[i] * coasting_[i];
  }
}

double Witness::variance(std::size_t j) const noexcept {
  const double error = model_error_ * volume_now_[j];
  return noise_variance_ + error * error;
}

WitnessResidual Witness::compare(double volume_temperature) const noexcept {
  // The volume temperature grows with alpha wherever light is still arriving; min and max also
  // serve where it does not.
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  double largest_variance = 0.0;
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    const Family& family = families_[b];
    if (!family.plausible) continue;
    const bool alone = family.high == family.low + 1 && family.low > b * model_.absorptions;
    const std::size_t below = family.low - (alone ? 1 : 0);
    const auto [low, high] =
        std::minmax_element(volume_now_.begin() + static_cast<std::ptrdiff_t>(below),
                            volume_now_.begin() + static_cast<std::ptrdiff_t>(family.high) + 1);
    least = std::min(least, *low);
    most = std::max(most, *high);
    largest_variance = std::max(largest_variance, variance(family.high));
  }
  const double beyond = std::max({0.0, least - volume_temperature, volume_temperature - most});
  return {.outside = beyond / std::sqrt(largest_variance), .above = volume_temperature > most};
}

void Witness::learn(double volume_temperature) noexcept {
  for (std::size_t j = 0; j < curves(); ++j) {
    const double residual = volume_temperature - volume_now_[j];
    for (PerCurve& misfit : misfit_) misfit[j] *= model_.memory;
    misfit_[next_][j] += residual * residual / variance(j);
  }
  next_ = 1 - next_;
  find_plausible();
}

void Witness::find_plausible() noexcept {
  for (Family& family : families_) family.plausible = false;
  for (const PerCurve& misfit : misfit_) {
    const auto end = misfit.begin() + static_cast<std::ptrdiff_t>(curves());
    const double bar = *std::min_element(misfit.begin(), end) + kPlausible;
    for (std::size_t b = 0; b < model_.choroids; ++b) {
      families_[b].widen_to(plausible_by(misfit, b * model_.absorptions, bar));
    }
  }
  if (model_.choroids > 1) {
    // The truth lies between nodes of a coarser grid that is judged by a longer memory. So that the
    // plausible curves enclose it, the next beta beyond the last plausible one counts with its best
    // alpha.
    std::array<bool, kWitnessChoroids> own{};
    for (std::size_t b = 0; b < model_.choroids; ++b) own[b] = families_[b].plausible;
    for (std::size_t b = 0; b < model_.choroids; ++b) {
      Family& family = families_[b];
      const bool beside = (b > 0 && own[b - 1]) || (b + 1 < model_.choroids && own[b + 1]);
      if (own[b] || !beside) continue;
      family.plausible = true;
      const bool last = family.low % model_.absorptions + 1 == model_.absorptions;
      family.high = last ? family.low : family.low + 1;
      family.fraction = last ? 1.0 : 0.0;
    }
  }
  high_alpha_ = 0.0;
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    if (!families_[b].plausible) continue;
    const std::size_t high = families_[b].high % model_.absorptions;
    high_alpha_ = std::max(
        high_alpha_, families_[b].at_high(model_.absorption[high - 1], model_.absorption[high]));
  }
}

void Witness::Family::widen_to(const Family& other) noexcept {
  if (!plausible) *this = other;
  if (!plausible || !other.plausible) return;
  low = std::min(low, other.low);
  if (other.high > high || (other.high == high && other.fraction > fraction)) {
    high = other.high;
    fraction = other.fraction;
  }
}

Witness::Family Witness::plausible_by(const PerCurve& misfit, std::size_t first,
                                      double bar) const noexcept {
  const std::size_t last = first + model_.absorptions - 1;
  const auto begin = misfit.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(model_.absorptions);
  const auto best = static_cast<std::size_t>(std::min_element(begin, end) - misfit.begin());
  if (misfit[best] > bar) {
    return {.plausible = false, .low = best, .high = last, .fraction = 1.0};
  }
  Family family{.plausible = true, .low = best, .high = last, .fraction = 1.0};
  while (family.low > first && misfit[family.low - 1] <= bar) --family.low;
  std::size_t inside = best;
  while (inside < last && misfit[inside + 1] <= bar) ++inside;
  if (inside < last) {
    family.high = inside + 1;
    // The misfit grows as the square of the distance from the best alpha.
    const auto distance = [&](double value) { return std::sqrt(value - misfit[best]); };
    family.fraction = (distance(bar) - distance(misfit[inside])) /
                      (distance(misfit[family.high]) - distance(misfit[inside]));
  }
  // The truth lies between nodes of a coarser grid: half a step where the best alpha is the only
  // one.
  if (model_.choroids > 1 && family.high == family.low + 1) {
    family.fraction = std::max(family.fraction, 0.5);
  }
  return family;
}

Witness::Family Witness::counted(std::size_t b) const noexcept {
  if (!suspicious_) return families_[b];
  const std::size_t first = b * model_.absorptions;
  return {.plausible = true, .low = first, .high = first + model_.absorptions - 1, .fraction = 1.0};
}

double Witness::peak_at_high(const Family& family, const Lags& lags) const noexcept {
  return family.at_high(dot(model_.peak[family.high - 1], lags),
                        dot(model_.peak[family.high], lags));
}

double Witness::peak_high() const noexcept {
  double highest = -std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    if (families_[b].plausible) highest = std::max(highest, peak_at_high(families_[b], lag_));
  }
  return highest;
}

double Witness::volume_high() const noexcept {
  double largest = 0.0;
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    if (families_[b].plausible) largest = std::max(largest, volume_now_[families_[b].high]);
  }
  return largest;
}

double Witness::power_for(double peak, const Lags& coasting, const Lags& held) const noexcept {
  double least = std::numeric_limits<double>::infinity();
  peak = (peak - model_.peak_error_K) / (1.0 + model_.peak_error);
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    const Family family = counted(b);
    if (!family.plausible) continue;
    least = std::min(least, (peak - peak_at_high(family, coasting)) / peak_at_high(family, held));
  }
  return std::max(0.0, least);
}

double Witness::power_for_peak(double peak) const noexcept {
  return power_for(peak, coasting_, held_1_);
}

double Witness::held_power_for_peak(double peak) const noexcept {
  return power_for(peak, coasting_2_, held_2_);
}

double Witness::late_power_for_peak(double peak, double before) const noexcept {
  Lags coasting = coasting_2_;
  for (std::size_t i = 0; i < kWitnessModes; ++i) coasting[i] += model_.decay[i] * before;
  return power_for(peak, coasting, held_1_);
}

double Witness::steady_power(double peak) const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    const Family family = counted(b);
    if (!family.plausible) continue;
    least = std::min(least, peak / family.at_high(model_.steady_peak[family.high - 1],
                                                  model_.steady_peak[family.high]));
  }
  return least;
}

}  // namespace photocoag
