#include "photocoag/safety/multi_model_observer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/core/wide_vectors.hpp"

namespace photocoag {
namespace {

constexpr double kPlausible = 12.0;   // 3.5 standard deviations of one parameter
constexpr double kLeastNoise = 0.02;  // K: a noise-free simulated eye still has a model error

double dot(const ObserverModel::Weights& weights,
           const std::array<double, kObserverModes>& lag) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < kObserverModes; ++i) sum += weights[i] * lag[i];
  return sum;
}

/// The smallest of `count` numbers.
double smallest(const double* values, std::size_t count) noexcept {
  if (count == 1) return values[0];
  // Two chains that stay in registers.
  double even = values[0];
  double odd = values[0];
  std::size_t k = 0;
  for (; k + 8 <= count; k += 8) {
    PHOTOCOAG_UNROLLED
    for (std::size_t l = 0; l < 8; l += 2) {
      even = even < values[k + l] ? even : values[k + l];
      odd = odd < values[k + l + 1] ? odd : values[k + l + 1];
    }
  }
  for (; k < count; ++k) even = std::min(even, values[k]);
  return std::min(even, odd);
}

/// The place of `value`, between first and last, that is nearest to `from`.
std::size_t nearest_of(const double* values, std::size_t first, std::size_t last, std::size_t from,
                       double value) noexcept {
  for (std::size_t away = 0; away <= last - first; ++away) {
    if (from >= first + away && values[from - away] == value) return from - away;
    if (from + away <= last && values[from + away] == value) return from + away;
  }
  return first;
}

constexpr std::size_t kBlock = 24;  // curves whose sums stay in registers
static_assert(kObserverCurves % kBlock == 0);

/// temperature_j = sum_i weight_ij lag_i of `curves` curves, rounded up to whole blocks.
PHOTOCOAG_WIDE_VECTORS void sum_lags(const double* __restrict weights, const double* __restrict lag,
                                     std::size_t curves, double* __restrict temperature) noexcept {
  for (std::size_t j = 0; j < curves; j += kBlock) {
    const double* column = weights + j;
    double sum[kBlock];
    for (std::size_t l = 0; l < kBlock; ++l) sum[l] = column[l] * lag[0];
    PHOTOCOAG_UNROLLED
    for (std::size_t i = 1; i < kObserverModes; ++i) {
      column += kObserverCurves;
      for (std::size_t l = 0; l < kBlock; ++l) sum[l] += column[l] * lag[i];
    }
    for (std::size_t l = 0; l < kBlock; ++l) temperature[j + l] = sum[l];
  }
}

struct Judgement {
  double memory;
  double noise_variance;
  double model_error;
};

/// A sample updates the misfits `judged`; `other` only decays.
PHOTOCOAG_WIDE_VECTORS void judge_curves(const double* __restrict temperature, std::size_t curves,
                                         double sample, Judgement by, double* __restrict judged,
                                         double* __restrict other) noexcept {
  for (std::size_t j = 0; j < curves; ++j) {
    const double residual = sample - temperature[j];
    const double error = by.model_error * temperature[j];
    const double variance = by.noise_variance + error * error;
    judged[j] = by.memory * judged[j] + residual * residual / variance;
    other[j] *= by.memory;
  }
}

}  // namespace

MultiModelObserver::MultiModelObserver(const ObserverModel& model, double noise,
                                       double model_error) noexcept
    : model_(model),
      noise_variance_(std::max(noise, kLeastNoise) * std::max(noise, kLeastNoise)),
      model_error_(model_error) {
  Lags held_1{};  // contribution to a lag of one period of 1 W, and of two
  Lags held_2{};
  for (std::size_t i = 0; i < kObserverModes; ++i) {
    held_1[i] = 1.0;
    held_2[i] = 1.0 + model_.decay[i];
    if (model_.decay[i] != 0.0) modes_ = i + 1;
    for (std::size_t j = 0; j < curves(); ++j) {
      volume_[i][j] = model_.volume[j][i];
      if (model_.volume[j][i] != 0.0 || model_.peak[j][i] != 0.0) modes_ = i + 1;
    }
  }
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    for (auto& best : best_) best[b] = b * model_.absorptions;
  }
  for (std::size_t j = 0; j < curves(); ++j) {
    rise_1_[j] = dot(model_.peak[j], held_1);
    rise_2_[j] = dot(model_.peak[j], held_2);
  }
  reset();
}

void MultiModelObserver::reset() noexcept {
  for (PerCurve& misfit : misfit_) misfit.fill(0.0);
  for (auto& least : least_) least.fill(0.0);
  find_plausible();
}

void MultiModelObserver::emit(double power) noexcept {
  Lags seen;
  if (model_.averaged) {
    for (std::size_t i = 0; i < kObserverModes; ++i) {
      seen[i] = model_.seen_before[i] * lag_[i] + model_.seen_power[i] * power;
    }
  }
  // Unused modes decay to 0 and have no weight: a loop of fixed length.
  for (std::size_t i = 0; i < kObserverModes; ++i) {
    lag_[i] = model_.decay[i] * lag_[i] + power;
    coasting_[i] = model_.decay[i] * lag_[i];
    coasting_2_[i] = model_.decay[i] * coasting_[i];
  }
  sum_lags(volume_.front().data(), (model_.averaged ? seen : lag_).data(), curves(),
           volume_now_.data());
  for (std::size_t j = 0; j < curves() && model_.averaged; ++j) {
    volume_now_[j] += model_.seen_feed[j] * power;
  }
}

void MultiModelObserver::queue(double power) noexcept {
  for (std::size_t i = 0; i < modes_; ++i) {
    coasting_[i] = model_.decay[i] * (coasting_[i] + power);
    coasting_2_[i] = model_.decay[i] * coasting_[i];
  }
}

double MultiModelObserver::variance(std::size_t j) const noexcept {
  const double error = model_error_ * volume_now_[j];
  return noise_variance_ + error * error;
}

ObserverResidual MultiModelObserver::compare(double volume_temperature) const noexcept {
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

void MultiModelObserver::update(double volume_temperature) noexcept {
  judge_curves(volume_now_.data(), curves(), volume_temperature,
               {model_.memory, noise_variance_, model_error_}, misfit_[next_].data(),
               misfit_[1 - next_].data());
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    least_[next_][b] = smallest(&misfit_[next_][b * model_.absorptions], model_.absorptions);
    least_[1 - next_][b] *= model_.memory;  // all decay alike, so it is still the smallest
  }
  next_ = 1 - next_;
  find_plausible();
}

void MultiModelObserver::find_plausible() noexcept {
  for (Family& family : families_) family.plausible = false;
  for (std::size_t half = 0; half < misfit_.size(); ++half) {
    const auto& least = least_[half];
    const double bar = smallest(least.data(), model_.choroids) + kPlausible;
    for (std::size_t b = 0; b < model_.choroids; ++b) {
      families_[b].widen_to(
          plausible_by(misfit_[half], b * model_.absorptions, least[b], bar, best_[half][b]));
    }
  }
  if (model_.choroids > 1) {
    // With two parameters the grid is coarser and its memory longer, and the truth lies between
    // nodes. To enclose it, the next beta beyond the last plausible one counts too, with its best
    // alpha.
    std::array<bool, kObserverChoroids> own{};
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
    const std::size_t high = families_[b].high - b * model_.absorptions;
    high_alpha_ = std::max(
        high_alpha_, families_[b].at_high(model_.absorption[high - 1], model_.absorption[high]));
  }
}

void MultiModelObserver::Family::widen_to(const Family& other) noexcept {
  if (!plausible) *this = other;
  if (!plausible || !other.plausible) return;
  low = std::min(low, other.low);
  if (other.high > high || (other.high == high && other.fraction > fraction)) {
    high = other.high;
    fraction = other.fraction;
  }
}

/// `first`: the family's first curve; `least`: its smallest misfit; `best`: in, the curve with that
/// misfit at the last sample; out, now.
MultiModelObserver::Family MultiModelObserver::plausible_by(const PerCurve& misfit,
                                                            std::size_t first, double least,
                                                            double bar,
                                                            std::size_t& best) const noexcept {
  const std::size_t last = first + model_.absorptions - 1;
  best = nearest_of(misfit.data(), first, last, best, least);
  if (least > bar) {
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
  // On the coarser grid the truth lies between nodes: widen by half a step if the best alpha is the
  // only one.
  if (model_.choroids > 1 && family.high == family.low + 1) {
    family.fraction = std::max(family.fraction, 0.5);
  }
  return family;
}

MultiModelObserver::Family MultiModelObserver::counted(std::size_t b) const noexcept {
  if (!suspicious_) return families_[b];
  const std::size_t first = b * model_.absorptions;
  return {.plausible = true, .low = first, .high = first + model_.absorptions - 1, .fraction = 1.0};
}

double MultiModelObserver::peak_at_high(const Family& family, const Lags& lags) const noexcept {
  return family.at_high(dot(model_.peak[family.high - 1], lags),
                        dot(model_.peak[family.high], lags));
}

double MultiModelObserver::peak_high() const noexcept {
  double highest = -std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    if (families_[b].plausible) highest = std::max(highest, peak_at_high(families_[b], lag_));
  }
  return highest;
}

double MultiModelObserver::volume_high() const noexcept {
  double largest = 0.0;
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    if (families_[b].plausible) largest = std::max(largest, volume_now_[families_[b].high]);
  }
  return largest;
}

double MultiModelObserver::power_for(double peak, const Lags& coasting,
                                     const PerCurve& rise) const noexcept {
  double least = std::numeric_limits<double>::infinity();
  peak = (peak - model_.peak_error_K) / (1.0 + model_.peak_error);
  for (std::size_t b = 0; b < model_.choroids; ++b) {
    const Family family = counted(b);
    if (!family.plausible) continue;
    least = std::min(least, (peak - peak_at_high(family, coasting)) /
                                family.at_high(rise[family.high - 1], rise[family.high]));
  }
  return std::max(0.0, least);
}

double MultiModelObserver::power_for_peak(double peak) const noexcept {
  return power_for(peak, coasting_, rise_1_);
}

double MultiModelObserver::held_power_for_peak(double peak) const noexcept {
  return power_for(peak, coasting_2_, rise_2_);
}

double MultiModelObserver::late_power_for_peak(double peak, double before) const noexcept {
  Lags coasting = coasting_2_;
  for (std::size_t i = 0; i < modes_; ++i) coasting[i] += model_.decay[i] * before;
  return power_for(peak, coasting, rise_1_);
}

double MultiModelObserver::steady_power(double peak) const noexcept {
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
