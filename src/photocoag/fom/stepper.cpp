#include "photocoag/fom/stepper.hpp"

#include "photocoag/core/error.hpp"
#include "photocoag/core/wide_vectors.hpp"
#include "photocoag/fom/mode_gain.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// The axial modes of one radial mode over one period, added to the profiles over depth.
PHOTOCOAG_WIDE_VECTORS void advance(double* __restrict state, const double* __restrict decay,
                                    const double* __restrict gain, Index modes, double power,
                                    double axis_weight, double spot_weight, double* __restrict axis,
                                    double* __restrict spot) noexcept {
  for (Index j = 0; j < modes; ++j) {
    const double next = decay[j] * state[j] + gain[j] * power;
    state[j] = next;
    axis[j] += axis_weight * next;
    spot[j] += spot_weight * next;
  }
}

}  // namespace

ModalStepper::ModalStepper(std::shared_ptr<const FullOrderModel> model,
                           Discretization discretization, double period, double negligible_decay)
    : model_(std::move(model)),
      discretization_(discretization),
      period_(period),
      negligible_decay_(negligible_decay),
      axis_weight_(model_->peak_radial().cwiseProduct(model_->beam())),
      spot_weight_(model_->beam().cwiseAbs2()) {
  if (!model_->separable()) throw Error("ModalStepper needs layers that conduct alike");
  prepare();
  reset();
}

void ModalStepper::prepare() {
  const VectorXd& radial = model_->radial().rates;
  const VectorXd& axial = model_->axial().rates;
  active_.assign(radial.size(), 0);
  decay_.clear();
  gain_.clear();
  axis_memoryless_ = VectorXd::Zero(axial.size());
  spot_memoryless_ = VectorXd::Zero(axial.size());
  for (Index i = 0; i < radial.size(); ++i) {
    // Rates ascend, so the modes with memory come first.
    bool memory = true;
    for (Index j = 0; j < axial.size(); ++j) {
      const double rate = radial[i] + axial[j];
      // Past that the decay vanishes in double precision: the gain is 1 / rate to the last bit.
      const bool settled = !memory && discretization_ == Discretization::kZeroOrderHold &&
                           rate * period_ > kSettledExponent;
      const ModeGain mode =
          settled ? ModeGain{0.0, 1.0 / rate} : mode_gain(discretization_, rate, period_);
      // TR-BDF2's decay factor changes its sign on the way to 0: all of its modes count.
      memory =
          memory && (discretization_ == Discretization::kTrBdf2 || mode.decay >= negligible_decay_);
      if (memory) {
        decay_.push_back(mode.decay);
        gain_.push_back(mode.gain);
        ++active_[i];
      } else {
        axis_memoryless_[j] += axis_weight_[i] * mode.gain;
        spot_memoryless_[j] += spot_weight_[i] * mode.gain;
      }
    }
  }
}

void ModalStepper::set_period(double period) {
  if (period == period_) return;
  if (negligible_decay_ != 0.0) throw Error("set_period needs a stepper that keeps every mode");
  period_ = period;
  prepare();
}

void ModalStepper::reset() noexcept {
  power_ = 0.0;
  state_.assign(decay_.size(), 0.0);
  axis_profile_ = VectorXd::Zero(model_->axial().size());
  spot_profile_ = VectorXd::Zero(model_->axial().size());
}

void ModalStepper::step(double power) noexcept {
  power_ = power;
  axis_profile_ = axis_memoryless_ * power;
  spot_profile_ = spot_memoryless_ * power;
  std::size_t at = 0;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    advance(state_.data() + at, decay_.data() + at, gain_.data() + at, active_[i], power,
            axis_weight_[static_cast<Index>(i)], spot_weight_[static_cast<Index>(i)],
            axis_profile_.data(), spot_profile_.data());
    at += static_cast<std::size_t>(active_[i]);
  }
}

Outputs ModalStepper::outputs(const OutputWeights& weights) const noexcept {
  return {.volume = weights.volume.dot(spot_profile_), .peak = weights.peak.dot(axis_profile_)};
}

Eigen::MatrixXd ModalStepper::temperatures(AbsorptionFactors at) const {
  const Modes& radial = model_->radial();
  const Modes& axial = model_->axial();
  const VectorXd source = model_->axial_source(at) * model_->input_gain();
  Eigen::MatrixXd coordinates(radial.size(), axial.size());
  std::size_t next = 0;
  for (Index i = 0; i < radial.size(); ++i) {
    for (Index j = 0; j < axial.size(); ++j) {
      const double state =
          j < active_[i]
              ? state_[next++]
              : mode_gain(discretization_, radial.rates[i] + axial.rates[j], period_).gain * power_;
      coordinates(i, j) = model_->beam()[i] * source[j] * state;
    }
  }
  const Eigen::MatrixXd cells = radial.vectors * coordinates * axial.vectors.transpose();
  return radial.root_measure.cwiseInverse().asDiagonal() * cells *
         axial.root_measure.cwiseInverse().asDiagonal();
}

}  // namespace photocoag
