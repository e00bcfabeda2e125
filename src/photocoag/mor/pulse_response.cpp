#include "photocoag/mor/pulse_response.hpp"

#include <cmath>

namespace photocoag {

using Eigen::Index;
using Eigen::VectorXd;

double mode_decay(double rate, Discretization discretization, double period) noexcept {
  return discretization == Discretization::kImplicitEuler ? 1.0 / (1.0 + rate * period)
                                                          : std::exp(-rate * period);
}

PulseResponse::PulseResponse(const ModeGroup& group, Discretization discretization, double period)
    : group_(group),
      discretization_(discretization),
      period_(period),
      decay_(group.rates.rows(), group.rates.cols()),
      state_(decay_.rows(), decay_.cols()),
      active_(static_cast<std::size_t>(decay_.cols()), decay_.rows()),
      profiles_(zero_profiles()) {
  constexpr double kDropped = 1e-20;
  for (Index i = 0; i < decay_.cols(); ++i) {
    for (Index j = 0; j < decay_.rows(); ++j) {
      const double rate = group.rates(j, i);
      decay_(j, i) = mode_decay(rate, discretization, period);
      state_(j, i) = discretization == Discretization::kImplicitEuler
                         ? period * decay_(j, i)
                         : -std::expm1(-rate * period) / rate;
    }
  }
  least_ = kDropped * state_;
  collect();
}

AxialProfiles PulseResponse::zero_profiles() const {
  const VectorXd zero = VectorXd::Zero(group_.rates.rows());
  return {zero, zero, zero};
}

void PulseResponse::collect() noexcept {
  profiles_.axis.setZero();
  profiles_.axis_magnitude.setZero();
  profiles_.spot.setZero();
  for (Index i = 0; i < static_cast<Index>(active_.size()); ++i) {
    const Index modes = active_[i];
    const auto state = state_.col(i).head(modes);
    profiles_.axis.head(modes) += group_.axis_weight[i] * state;
    profiles_.axis_magnitude.head(modes) += std::abs(group_.axis_weight[i]) * state;
    profiles_.spot.head(modes) += group_.spot_weight[i] * state;
  }
}

void PulseResponse::advance() noexcept {
  for (Index i = 0; i < static_cast<Index>(active_.size()); ++i) {
    Index& modes = active_[i];
    state_.col(i).head(modes).array() *= decay_.col(i).head(modes).array();
    while (modes > 0 && state_(modes - 1, i) <= least_(modes - 1, i)) --modes;
  }
  // Radial rates ascend: once one radial mode has vanished, so have all faster ones.
  while (active_.size() > 1 && active_.back() == 0) active_.pop_back();
  collect();
}

AxialProfiles PulseResponse::sum_after(double after) const {
  AxialProfiles sum = zero_profiles();
  for (Index i = 0; i < group_.rates.cols(); ++i) {
    for (Index j = 0; j < group_.rates.rows(); ++j) {
      const double rate = group_.rates(j, i);
      const double share = std::pow(mode_decay(rate, discretization_, period_), after) / rate;
      if (share == 0.0) break;  // and so are all faster ones
      sum.axis[j] += group_.axis_weight[i] * share;
      sum.axis_magnitude[j] += std::abs(group_.axis_weight[i]) * share;
      sum.spot[j] += group_.spot_weight[i] * share;
    }
  }
  return sum;
}

}  // namespace photocoag
