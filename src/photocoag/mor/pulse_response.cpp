#include "photocoag/mor/pulse_response.hpp"

#include <cmath>

namespace photocoag {

using Eigen::Index;
using Eigen::VectorXd;

PulseResponse::PulseResponse(const FullOrderModel& model, Discretization discretization,
                             double period)
    : model_(model),
      discretization_(discretization),
      period_(period),
      axis_weight_(model.peak_radial().cwiseProduct(model.beam())),
      spot_weight_(model.beam().cwiseAbs2()),
      decay_(model.axial().size(), model.radial().size()),
      state_(decay_.rows(), decay_.cols()),
      active_(static_cast<std::size_t>(decay_.cols()), decay_.rows()),
      slowest_decay_(decay(model.radial().rates[0] + model.axial().rates[0])),
      profiles_(zero_profiles()) {
  constexpr double kDropped = 1e-20;
  for (Index i = 0; i < decay_.cols(); ++i) {
    for (Index j = 0; j < decay_.rows(); ++j) {
      const double rate = model.radial().rates[i] + model.axial().rates[j];
      decay_(j, i) = decay(rate);
      state_(j, i) = discretization == Discretization::kImplicitEuler
                         ? period * decay_(j, i)
                         : -std::expm1(-rate * period) / rate;
    }
  }
  least_ = kDropped * state_;
  collect();
}

double PulseResponse::decay(double rate) const noexcept {
  return discretization_ == Discretization::kImplicitEuler ? 1.0 / (1.0 + rate * period_)
                                                           : std::exp(-rate * period_);
}

AxialProfiles PulseResponse::zero_profiles() const {
  const VectorXd zero = VectorXd::Zero(model_.axial().size());
  return {zero, zero, zero};
}

void PulseResponse::collect() noexcept {
  profiles_.axis.setZero();
  profiles_.axis_magnitude.setZero();
  profiles_.spot.setZero();
  for (Index i = 0; i < static_cast<Index>(active_.size()); ++i) {
    const Index modes = active_[i];
    const auto state = state_.col(i).head(modes);
    profiles_.axis.head(modes) += axis_weight_[i] * state;
    profiles_.axis_magnitude.head(modes) += std::abs(axis_weight_[i]) * state;
    profiles_.spot.head(modes) += spot_weight_[i] * state;
  }
}

void PulseResponse::advance() noexcept {
  for (Index i = 0; i < static_cast<Index>(active_.size()); ++i) {
    Index& modes = active_[i];
    state_.col(i).head(modes).array() *= decay_.col(i).head(modes).array();
    while (modes > 0 && state_(modes - 1, i) <= least_(modes - 1, i)) --modes;
  }
  // Radial rates ascend: once nothing is left in one radial mode, nothing is in those behind it.
  while (active_.size() > 1 && active_.back() == 0) active_.pop_back();
  collect();
}

AxialProfiles PulseResponse::sum_after(double after) const {
  AxialProfiles sum = zero_profiles();
  const VectorXd& axial = model_.axial().rates;
  for (Index i = 0; i < model_.radial().size(); ++i) {
    for (Index j = 0; j < axial.size(); ++j) {
      const double rate = model_.radial().rates[i] + axial[j];
      const double share = std::pow(decay(rate), after) / rate;
      if (share == 0.0) break;  // and so are all faster ones
      sum.axis[j] += axis_weight_[i] * share;
      sum.axis_magnitude[j] += std::abs(axis_weight_[i]) * share;
      sum.spot[j] += spot_weight_[i] * share;
    }
  }
  return sum;
}

}  // namespace photocoag
