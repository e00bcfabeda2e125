// Role: studies; Algorithm 1 on one eye with a callback per cycle, without device, supervisor or
// records; and means over cycles. Used by estimation_study, unknowns_study, information. Units: SI.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/plant.hpp"

namespace photocoag {

/// The eye gets the controller's power unchanged.
inline constexpr auto kAllPower = [](double power, std::size_t) { return power; };

/// `power_of(decided, k)`: power that the eye gets, W, while the controller assumes `decided`.
/// `sample_of(truth, k)`: K; NaN: none. `look(truth, estimate, k)`: called at the end of cycle k.
/// `dark`: 0 W throughout instead of the controller's power.
void run_plain_loop(Controller& controller, Plant auto& eye, std::size_t cycles, bool dark,
                    const auto& power_of, const auto& sample_of, const auto& look) {
  for (std::size_t k = 0; k < cycles; ++k) {
    const double power = dark ? 0.0 : controller.decide().power;
    eye.step(power_of(power, k));
    const Outputs truth = eye.outputs();
    const Estimate estimate = controller.observe(
        {.volume_temperature = sample_of(truth.volume, k), .applied_power = power});
    look(truth, estimate, k);
  }
}

/// A number of each cycle: a mean, or the root of a mean of squares.
template <typename Cycle>
struct CycleNumber {
  double Cycle::*value;
  bool root = false;
};

/// Turns sums over eyes into means, or root mean squares where `root`.
template <typename Cycle>
void divide(Cycle& sums, const auto& numbers, double eyes) {
  for (const CycleNumber<Cycle>& number : numbers) {
    double& value = sums.*number.value;
    value /= eyes;
    if (number.root) value = std::sqrt(value);
  }
}

/// Means over cycles [begin, end).
template <typename Cycle>
Cycle mean_over(const std::vector<Cycle>& cycles, const auto& numbers, std::size_t begin,
                std::size_t end) {
  Cycle mean;
  end = std::min(end, cycles.size());
  for (const CycleNumber<Cycle>& number : numbers) {
    double& sum = mean.*number.value;
    for (std::size_t k = begin; k < end; ++k) {
      const double value = cycles[k].*number.value;
      sum += (number.root ? value * value : value) / static_cast<double>(end - begin);
    }
    if (number.root) sum = std::sqrt(sum);
  }
  return mean;
}

}  // namespace photocoag
