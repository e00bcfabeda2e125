#include "photocoag/fom/sampled_plant.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/core/wide_vectors.hpp"
#include "photocoag/fom/mode_gain.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kNegligible = 1e-15;  // of a mode's own response

// Shares of one radial mode's axial modes from `first` on, which follow the power at once.
PHOTOCOAG_WIDE_VECTORS void add_memoryless(const double* __restrict axial, double radial,
                                           Index first, Index modes, double axis_weight,
                                           double spot_weight, double* __restrict axis,
                                           double* __restrict spot) noexcept {
  for (Index j = first; j < modes; ++j) {
    const double gain = 1.0 / (radial + axial[j]);
    axis[j] += axis_weight * gain;
    spot[j] += spot_weight * gain;
  }
}

// Adds the modes to the profiles over depth, then decays them by one period.
PHOTOCOAG_WIDE_VECTORS void fade(double* __restrict state, const double* __restrict decay,
                                 Index modes, double axis_weight, double spot_weight,
                                 double* __restrict axis, double* __restrict spot) noexcept {
  for (Index j = 0; j < modes; ++j) {
    axis[j] += axis_weight * state[j];
    spot[j] += spot_weight * state[j];
    state[j] *= decay[j];
  }
}

// exp(-(x + y)) and expm1(-(x + y)) from those of x and y: no cancellation, both expm1 are < 0.
PHOTOCOAG_WIDE_VECTORS void exact_gains(const double* __restrict axial_rates,
                                        const double* __restrict axial_expm1, double radial_rate,
                                        double radial_expm1, Index modes, double* __restrict decay,
                                        double* __restrict gain) noexcept {
  for (Index j = 0; j < modes; ++j) {
    decay[j] = (1.0 + radial_expm1) * (1.0 + axial_expm1[j]);
    gain[j] = -(radial_expm1 + axial_expm1[j] + radial_expm1 * axial_expm1[j]) /
              (radial_rate + axial_rates[j]);
  }
}

// Two sums of products with the same powers, each in eight lanes: their order is fixed.
PHOTOCOAG_WIDE_VECTORS void convolve(const double* __restrict peak, const double* __restrict volume,
                                     const double* __restrict powers, std::size_t count,
                                     double* __restrict sums) noexcept {
  constexpr std::size_t kLanes = 8;
  std::array<double, kLanes> first{};
  std::array<double, kLanes> second{};
  std::size_t k = 0;
  for (; k + kLanes <= count; k += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      first[lane] += peak[k + lane] * powers[k + lane];
      second[lane] += volume[k + lane] * powers[k + lane];
    }
  }
  for (; k < count; ++k) {
    first[0] += peak[k] * powers[k];
    second[0] += volume[k] * powers[k];
  }
  sums[0] = 0.0;
  sums[1] = 0.0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    sums[0] += first[lane];
    sums[1] += second[lane];
  }
}

}  // namespace

SampledPlant::SampledPlant(const FullOrderModel& model, Discretization discretization,
                           double period, AbsorptionFactors absorption, std::size_t steps)
    : peak_(steps), volume_(steps), powers_(steps) {
  if (!model.separable()) throw Error("SampledPlant needs layers that conduct alike");
  const OutputWeights weights = model.output_weights(absorption);
  const VectorXd axis_weight = model.peak_radial().cwiseProduct(model.beam());
  const VectorXd spot_weight = model.beam().cwiseAbs2();
  const VectorXd& radial = model.radial().rates;
  const VectorXd& axial = model.axial().rates;
  const bool exact = discretization == Discretization::kZeroOrderHold;
  VectorXd axial_expm1(axial.size());
  if (exact) {
    for (Index j = 0; j < axial.size(); ++j) axial_expm1[j] = std::expm1(-axial[j] * period);
  }

  VectorXd axis = VectorXd::Zero(axial.size());
  VectorXd spot = VectorXd::Zero(axial.size());
  std::vector<Index> active(static_cast<std::size_t>(radial.size()));
  std::vector<std::size_t> start(active.size());
  std::vector<double> state;
  std::vector<double> decay;
  Index modes = axial.size();
  for (Index i = 0; i < radial.size(); ++i) {
    // Rates ascend: the modes with memory come first, and are fewer from one i to the next.
    while (exact && modes > 0 && (radial[i] + axial[modes - 1]) * period > kSettledExponent)
      --modes;
    const std::size_t at = state.size();
    start[static_cast<std::size_t>(i)] = at;
    active[static_cast<std::size_t>(i)] = modes;
    state.resize(at + static_cast<std::size_t>(modes));
    decay.resize(state.size());
    if (exact) {
      exact_gains(axial.data(), axial_expm1.data(), radial[i], std::expm1(-radial[i] * period),
                  modes, decay.data() + at, state.data() + at);
    } else {
      for (Index j = 0; j < modes; ++j) {
        const ModeGain mode = mode_gain(discretization, radial[i] + axial[j], period);
        decay[at + static_cast<std::size_t>(j)] = mode.decay;
        state[at + static_cast<std::size_t>(j)] = mode.gain;
      }
    }
    add_memoryless(axial.data(), radial[i], modes, axial.size(), axis_weight[i], spot_weight[i],
                   axis.data(), spot.data());
  }
  const std::vector<double> gain = state;
  for (std::size_t m = 0; m < steps; ++m) {
    for (Index i = 0; i < radial.size(); ++i) {
      const std::size_t at = start[static_cast<std::size_t>(i)];
      Index& left = active[static_cast<std::size_t>(i)];
      fade(state.data() + at, decay.data() + at, left, axis_weight[i], spot_weight[i], axis.data(),
           spot.data());
      const auto gone = [&](Index j) {
        const std::size_t mode = at + static_cast<std::size_t>(j);
        return std::abs(state[mode]) < kNegligible * gain[mode];
      };
      while (left > 0 && gone(left - 1)) --left;
    }
    peak_[steps - 1 - m] = weights.peak.dot(axis);
    volume_[steps - 1 - m] = weights.volume.dot(spot);
    axis.setZero();
    spot.setZero();
  }
}

void SampledPlant::step(double power) noexcept {
  if (done_ == powers_.size()) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    outputs_ = {.volume = kNone, .peak = kNone};
    return;
  }
  powers_[done_++] = power;
  const std::size_t from = powers_.size() - done_;
  std::array<double, 2> sums{};
  convolve(peak_.data() + from, volume_.data() + from, powers_.data(), done_, sums.data());
  outputs_ = {.volume = sums[1], .peak = sums[0]};
}

}  // namespace photocoag
