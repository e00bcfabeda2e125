#include "photocoag/fom/intersample_plant.hpp"

#include <cmath>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::VectorXd;

IntersamplePlant::IntersamplePlant(std::shared_ptr<const FullOrderModel> model, double period,
                                   AbsorptionFactors absorption, const IntersampleTiming& timing,
                                   double drift, double negligible_decay)
    : model_(std::move(model)),
      period_(period),
      absorption_(absorption),
      first_(absorption),
      drift_(drift),
      windows_(sample_windows(timing)) {
  if (!model_->separable()) throw Error("IntersamplePlant needs layers that conduct alike");
  const VectorXd& radial = model_->radial().rates;
  const VectorXd& axial = model_->axial().rates;
  for (Index i = 0; i < radial.size(); ++i) {
    Index memory = 0;  // rates ascend
    while (memory < axial.size()) {
      const double rate = radial[i] + axial[memory];
      const double decay = std::exp(-rate * period_);
      if (decay < negligible_decay) break;
      decay_.push_back(decay);
      gain_.push_back(-std::expm1(-rate * period_) / rate);
      ++memory;
    }
    active_.push_back(memory);
  }
  state_.assign(decay_.size(), 0.0);
  const VectorXd spot = model_->beam().cwiseAbs2();
  for (int k = 0; k < SampleWindows::kMost; ++k) {
    if (windows_.share[k] > 0.0) samples_[k] = make_view(windows_.window[k], spot);
  }
  const double end = 1.0 - timing.power_lag;
  volume_ = make_view({end, end}, spot);
  peak_ = make_view({end, end}, model_->peak_radial().cwiseProduct(model_->beam()));
  absorbed_.resize(axial.size());
  source_.resize(axial.size());
  heat_ = VectorXd::Zero(axial.size());
  heat_before_ = VectorXd::Zero(axial.size());
  set_source();
}

IntersamplePlant::View IntersamplePlant::make_view(Window window,
                                                   const VectorXd& radial_weight) const {
  const VectorXd& radial = model_->radial().rates;
  const VectorXd& axial = model_->axial().rates;
  View view{.window = window,
            .radial_weight = radial_weight,
            .decay = {},
            .before = VectorXd::Zero(axial.size()),
            .rise = VectorXd::Zero(axial.size()),
            .profile = VectorXd::Zero(axial.size())};
  for (Index i = 0; i < radial.size(); ++i) {
    for (Index j = 0; j < axial.size(); ++j) {
      const double rate = radial[i] + axial[j];
      const double left = radial_weight[i] * mean_decay(rate * period_, window);
      view.rise[j] += radial_weight[i] * mean_rise(rate * period_, window) / rate;
      if (j < active_[static_cast<std::size_t>(i)]) {
        view.decay.push_back(left);
      } else {
        view.before[j] += left / rate;  // its state is the steady one of the heat before
      }
    }
  }
  return view;
}

void IntersamplePlant::set_source() noexcept {
  const auto& cells = model_->cell_absorption();
  const Modes& axial = model_->axial();
  for (Index j = 0; j < absorbed_.size(); ++j) {
    absorbed_[j] =
        cells[static_cast<std::size_t>(j)].evaluate(absorption_).value / axial.root_measure[j];
  }
  for (Index j = 0; j < source_.size(); ++j) source_[j] = axial.vectors.col(j).dot(absorbed_);
  norm_ = model_->volume_norm(absorption_);
}

// From the state at the moment at which the new heat begins to act.
void IntersamplePlant::look(View& view) noexcept {
  view.profile = view.before.cwiseProduct(heat_before_) + view.rise.cwiseProduct(heat_);
  std::size_t at = 0;
  for (const Index modes : active_) {
    const double* __restrict state = state_.data() + at;
    const double* __restrict decay = view.decay.data() + at;
    double* __restrict profile = view.profile.data();
    for (Index j = 0; j < modes; ++j) profile[j] += decay[j] * state[j];
    at += static_cast<std::size_t>(modes);
  }
}

double IntersamplePlant::volume(const View& view) const noexcept {
  return source_.dot(view.profile) / norm_;
}

void IntersamplePlant::step(double power) noexcept {
  if (drift_ != 0.0) {
    const double time = static_cast<double>(periods_) * period_;
    absorption_.alpha = drifted_absorption(first_.alpha, drift_, time);
    set_source();
  }
  ++periods_;
  heat_before_.swap(heat_);
  heat_ = source_ * (model_->input_gain() * power);
  seen_twice_ = seen_once_[2];
  seen_once_ = seen_;
  for (int k = 0; k < SampleWindows::kMost; ++k) {
    if (windows_.share[k] == 0.0) continue;
    look(samples_[k]);
    seen_[k] = windows_.share[k] * volume(samples_[k]);
  }
  sample_ = seen_[0] + seen_once_[1] + seen_twice_;
  look(volume_);
  look(peak_);
  outputs_ = {.volume = volume(volume_), .peak = model_->peak_axial().dot(peak_.profile)};
  std::size_t at = 0;
  for (const Index modes : active_) {
    for (Index j = 0; j < modes; ++j, ++at) {
      state_[at] = decay_[at] * state_[at] + gain_[at] * heat_[j];
    }
  }
}

}  // namespace photocoag
