#include "photocoag/fom/layered_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/block_tridiagonal.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// Added to every right-hand side: far from the source the solution would become denormal, which
// many processors handle a hundred times more slowly.
constexpr double kKeepNormal = 1e-250;

VectorXd padded(const VectorXd& values, Index size, double fill) {
  VectorXd result = VectorXd::Constant(size, fill);
  result.head(values.size()) = values;
  return result;
}

void nonzero_range(const VectorXd& values, Index& first, Index& last) {
  first = 0;
  last = values.size();
  while (first < last && values[first] == 0.0) ++first;
  while (last > first && values[last - 1] == 0.0) --last;
}

}  // namespace

LayeredStepper::LayeredStepper(std::shared_ptr<const FullOrderModel> model,
                               Discretization discretization, double period,
                               AbsorptionFactors absorption, double negligible_decay)
    : LayeredStepper(model, discretization, period, model->axial_source(absorption),
                     negligible_decay) {
  volume_norm_ = model_->volume_norm(absorption);
  steady_gain_.volume /= volume_norm_;
}

LayeredStepper::LayeredStepper(std::shared_ptr<const FullOrderModel> model,
                               Discretization discretization, double period,
                               const VectorXd& axial_source, double negligible_decay)
    : model_(std::move(model)),
      discretization_(discretization),
      period_(period),
      negligible_decay_(negligible_decay),
      cells_(axial_source.size()),
      source_(model_->input_gain() * axial_source),
      volume_weight_(axial_source),
      peak_weight_(model_->peak_axial()) {
  if (model_->separable()) throw Error("LayeredStepper is for layers that conduct differently");
  const VectorXd& rates = model_->radial().rates;
  blocks_ = (rates.size() + kLanes - 1) / kLanes;
  // The padding has no source and stays at zero.
  rates_ = padded(rates, blocks_ * kLanes, rates.tail(1)[0]);
  beam_ = padded(model_->beam(), blocks_ * kLanes, 0.0);
  peak_radial_ = padded(model_->peak_radial(), blocks_ * kLanes, 0.0);
  nonzero_range(volume_weight_, volume_first_, volume_last_);
  nonzero_range(peak_weight_, peak_first_, peak_last_);
  prepare();
  reset();
}

void LayeredStepper::prepare() {
  const DepthOperator& depth = model_->depth_operator();
  active_blocks_ = blocks_;
  if (discretization_ == Discretization::kZeroOrderHold && negligible_decay_ > 0.0) {
    // Rates ascend: the modes with memory come first.
    const double limit = -std::log(negligible_decay_) / (period_ * depth.diffusivity.minCoeff());
    const auto active = std::upper_bound(rates_.begin(), rates_.end(), limit) - rates_.begin();
    active_blocks_ = (static_cast<Index>(active) + kLanes - 1) / kLanes;
  }
  scratch_.resize(static_cast<std::size_t>(cells_ * kLanes));
  switch (discretization_) {
    case Discretization::kZeroOrderHold:
      scratch_imag_.resize(scratch_.size());
      sum_.resize(scratch_.size());
      coupling_ = period_ * depth.off_diagonal;
      for (int pair = 0; pair < RationalExponential::kPairs; ++pair) factorize_complex(pair);
      break;
    case Discretization::kImplicitEuler:
      coupling_ = period_ * depth.off_diagonal;
      factorize_real(1.0, period_, 0, blocks_, inverse_pivot_);
      break;
    case Discretization::kTrBdf2:
      coupling_ = TrBdf2::kShift * period_ * depth.off_diagonal;
      factorize_real(1.0, TrBdf2::kShift * period_, 0, blocks_, inverse_pivot_);
      break;
  }
  add_steady_modes();
  plan_sleep();
}

// Inverse pivots of constant + scale * S_i for every mode of the blocks.
void LayeredStepper::factorize_real(double constant, double scale, Index first_block, Index blocks,
                                    std::vector<double>& inverse_pivot) const {
  const DepthOperator& depth = model_->depth_operator();
  inverse_pivot.resize(static_cast<std::size_t>(blocks * cells_ * kLanes));
  for (Index b = 0; b < blocks; ++b) {
    double* inverse = inverse_pivot.data() + b * cells_ * kLanes;
    for (Index j = 0; j < cells_; ++j) {
      const double coupling = j == 0 ? 0.0 : scale * depth.off_diagonal[j - 1];
      for (Index l = 0; l < kLanes; ++l) {
        const double rate = rates_[(first_block + b) * kLanes + l];
        const double before = j == 0 ? 0.0 : inverse[(j - 1) * kLanes + l];
        const double entry = scale * (rate * depth.diffusivity[j] + depth.diagonal[j]);
        inverse[j * kLanes + l] = 1.0 / (constant + entry - coupling * coupling * before);
      }
    }
  }
}

// Inverse pivots of pole + h S_i. Its imaginary part is a positive multiple of the identity, so
// that no pivot vanishes.
void LayeredStepper::factorize_complex(int pair) {
  const DepthOperator& depth = model_->depth_operator();
  const std::complex<double> pole = RationalExponential::kPoles[pair];
  ComplexFactor& factor = complex_[pair];
  factor.real.resize(static_cast<std::size_t>(active_blocks_ * cells_ * kLanes));
  factor.imag.resize(factor.real.size());
  for (Index b = 0; b < active_blocks_; ++b) {
    for (Index l = 0; l < kLanes; ++l) {
      const double rate = rates_[b * kLanes + l];
      std::complex<double> inverse = 0.0;
      for (Index j = 0; j < cells_; ++j) {
        const double coupling = j == 0 ? 0.0 : coupling_[j - 1];
        const double entry = period_ * (rate * depth.diffusivity[j] + depth.diagonal[j]);
        inverse = 1.0 / (pole + entry - coupling * coupling * inverse);
        factor.real[(b * cells_ + j) * kLanes + l] = inverse.real();
        factor.imag[(b * cells_ + j) * kLanes + l] = inverse.imag();
      }
    }
  }
}

// Steady states of the modes without memory, per watt, and their share of the outputs.
void LayeredStepper::add_steady_modes() {
  const Index steady_blocks = blocks_ - active_blocks_;
  steady_.assign(static_cast<std::size_t>(steady_blocks * cells_ * kLanes), 0.0);
  steady_gain_ = {};
  if (steady_blocks == 0) return;
  std::vector<double> inverse;
  factorize_real(0.0, 1.0, active_blocks_, steady_blocks, inverse);
  const VectorXd& coupling = model_->depth_operator().off_diagonal;
  for (Index b = 0; b < steady_blocks; ++b) {
    const double* beam = beam_.data() + (active_blocks_ + b) * kLanes;
    double* y = steady_.data() + b * cells_ * kLanes;
    solve_block<kLanes>(cells_, inverse.data() + b * cells_ * kLanes, coupling.data(), y,
                        [&](Index j, Index l) { return source_[j] * beam[l]; });
    for (Index l = 0; l < kLanes; ++l) {
      const double peak_radial = peak_radial_[(active_blocks_ + b) * kLanes + l];
      for (Index j = 0; j < cells_; ++j) {
        steady_gain_.volume += beam[l] * volume_weight_[j] * y[j * kLanes + l];
        steady_gain_.peak += peak_radial * peak_weight_[j] * y[j * kLanes + l];
      }
    }
  }
  steady_gain_.volume /= volume_norm_;
}

// For how many periods without power each block matters: until its slowest mode, which no axial
// rate and no perfusion slows down further, has decayed to negligible_decay.
void LayeredStepper::plan_sleep() {
  awake_for_.assign(static_cast<std::size_t>(active_blocks_),
                    std::numeric_limits<double>::infinity());
  if (negligible_decay_ == 0.0) return;
  for (Index b = 0; b < active_blocks_; ++b) {
    const double exponent =
        period_ * rates_[b * kLanes] * model_->depth_operator().diffusivity.minCoeff();
    double log_decay = -exponent;
    if (discretization_ == Discretization::kImplicitEuler) log_decay = -std::log1p(exponent);
    if (discretization_ == Discretization::kTrBdf2) {
      // The factor falls through 0 to its least value before it returns to 0.
      log_decay = std::log(std::max(TrBdf2::decay(exponent), -TrBdf2::kLeastDecay));
    }
    if (log_decay < 0.0) {
      awake_for_[static_cast<std::size_t>(b)] = std::log(negligible_decay_) / log_decay;
    }
  }
}

void LayeredStepper::put_to_sleep() noexcept {
  ++dark_steps_;
  while (awake_ > 0 &&
         static_cast<double>(dark_steps_) >= awake_for_[static_cast<std::size_t>(awake_ - 1)]) {
    --awake_;
    double* x = state_.data() + awake_ * cells_ * kLanes;
    std::fill(x, x + cells_ * kLanes, 0.0);
  }
}

void LayeredStepper::set_period(double period) {
  if (period == period_) return;
  const bool forgets =
      discretization_ == Discretization::kZeroOrderHold && negligible_decay_ != 0.0;
  if (forgets) throw Error("set_period needs a stepper that keeps every mode");
  period_ = period;
  prepare();
}

void LayeredStepper::reset() noexcept {
  power_ = 0.0;
  cold_ = true;
  outputs_ = {};
  awake_ = active_blocks_;
  dark_steps_ = 0;
  state_.assign(static_cast<std::size_t>(active_blocks_ * cells_ * kLanes), 0.0);
}

void LayeredStepper::step(double power) noexcept {
  power_ = power;
  if (cold_ && power == 0.0) return;
  cold_ = false;
  outputs_ = {};
  if (power == 0.0) {
    put_to_sleep();
  } else {
    awake_ = active_blocks_;
    dark_steps_ = 0;
  }
  switch (discretization_) {
    case Discretization::kZeroOrderHold:
      step_zero_order_hold(power);
      break;
    case Discretization::kImplicitEuler:
      step_implicit_euler(power);
      break;
    case Discretization::kTrBdf2:
      step_tr_bdf2(power);
      break;
  }
  outputs_.volume = outputs_.volume / volume_norm_ + power * steady_gain_.volume;
  outputs_.peak += power * steady_gain_.peak;
}

// Adds one block's share to the outputs while its state is still in the cache.
void LayeredStepper::add_outputs(Index block) noexcept {
  const double* __restrict x = state_.data() + block * cells_ * kLanes;
  const double* __restrict beam = beam_.data() + block * kLanes;
  const double* __restrict peak_radial = peak_radial_.data() + block * kLanes;
  double volume[kLanes] = {};
  double peak[kLanes] = {};
  for (Index j = volume_first_; j < volume_last_; ++j) {
    const double weight = volume_weight_[j];
    for (Index l = 0; l < kLanes; ++l) volume[l] += weight * x[j * kLanes + l];
  }
  for (Index j = peak_first_; j < peak_last_; ++j) {
    for (Index l = 0; l < kLanes; ++l) peak[l] += peak_weight_[j] * x[j * kLanes + l];
  }
  for (Index l = 0; l < kLanes; ++l) {
    outputs_.volume += beam[l] * volume[l];
    outputs_.peak += peak_radial[l] * peak[l];
  }
}

void LayeredStepper::step_implicit_euler(double power) noexcept {
  for (Index b = 0; b < awake_; ++b) {
    double* x = state_.data() + b * cells_ * kLanes;
    double heat[kLanes];
    for (Index l = 0; l < kLanes; ++l) heat[l] = period_ * power * beam_[b * kLanes + l];
    const double* __restrict source = source_.data();
    solve_block<kLanes>(cells_, inverse_pivot_.data() + b * cells_ * kLanes, coupling_.data(), x,
                        [=, &heat](Index j, Index l) {
                          return x[j * kLanes + l] + source[j] * heat[l] + kKeepNormal;
                        });
    add_outputs(b);
  }
}

void LayeredStepper::step_tr_bdf2(double power) noexcept {
  for (Index b = 0; b < awake_; ++b) {
    double* x = state_.data() + b * cells_ * kLanes;
    double* mean = scratch_.data();
    const double* inverse = inverse_pivot_.data() + b * cells_ * kLanes;
    double heat[kLanes];
    for (Index l = 0; l < kLanes; ++l) {
      heat[l] = TrBdf2::kShift * period_ * power * beam_[b * kLanes + l];
    }
    const double* __restrict source = source_.data();
    solve_block<kLanes>(cells_, inverse, coupling_.data(), mean, [=, &heat](Index j, Index l) {
      return x[j * kLanes + l] + source[j] * heat[l] + kKeepNormal;
    });
    solve_block<kLanes>(cells_, inverse, coupling_.data(), x, [=, &heat](Index j, Index l) {
      return TrBdf2::kMix * mean[j * kLanes + l] + (1.0 - TrBdf2::kMix) * x[j * kLanes + l] +
             source[j] * heat[l] + kKeepNormal;
    });
    add_outputs(b);
  }
}

void LayeredStepper::step_zero_order_hold(double power) noexcept {
  for (Index b = 0; b < awake_; ++b) {
    double* x = state_.data() + b * cells_ * kLanes;
    double* sum = sum_.data();
    double* re = scratch_.data();
    double* im = scratch_imag_.data();
    const double* __restrict source = source_.data();
    const Index count = cells_ * kLanes;
    for (Index i = 0; i < count; ++i) sum[i] = RationalExponential::kAtInfinity * x[i];
    for (int pair = 0; pair < RationalExponential::kPairs; ++pair) {
      // x - pole of the formula is -(h S + pole): hence the minus sign of the sum.
      const std::complex<double> input = period_ * power / RationalExponential::kPoles[pair];
      const double residue_re = 2.0 * RationalExponential::kResidues[pair].real();
      const double residue_im = 2.0 * RationalExponential::kResidues[pair].imag();
      double heat_re[kLanes];
      double heat_im[kLanes];
      for (Index l = 0; l < kLanes; ++l) {
        heat_re[l] = input.real() * beam_[b * kLanes + l];
        heat_im[l] = input.imag() * beam_[b * kLanes + l];
      }
      solve_block_complex<kLanes>(
          cells_, complex_[pair].real.data() + b * count, complex_[pair].imag.data() + b * count,
          coupling_.data(), re, im,
          [=, &heat_re](Index j, Index l) {
            return x[j * kLanes + l] + source[j] * heat_re[l] + kKeepNormal;
          },
          [=, &heat_im](Index j, Index l) { return source[j] * heat_im[l]; });
      for (Index i = 0; i < count; ++i) sum[i] -= residue_re * re[i] - residue_im * im[i];
    }
    std::copy(sum, sum + count, x);
    add_outputs(b);
  }
}

double LayeredStepper::coordinate(Index i, Index j) const noexcept {
  const Index block = i / kLanes;
  const Index lane = i % kLanes;
  if (block < active_blocks_) return state_[(block * cells_ + j) * kLanes + lane];
  return power_ * steady_[((block - active_blocks_) * cells_ + j) * kLanes + lane];
}

VectorXd LayeredStepper::spot_profile() const {
  VectorXd profile = VectorXd::Zero(cells_);
  for (Index b = 0; b < blocks_; ++b) {
    const bool active = b < active_blocks_;
    if (active ? b >= awake_ : power_ == 0.0) continue;
    const double* x = active ? state_.data() + b * cells_ * kLanes
                             : steady_.data() + (b - active_blocks_) * cells_ * kLanes;
    const Eigen::Map<const Eigen::Matrix<double, kLanes, Eigen::Dynamic>> block(x, kLanes, cells_);
    profile.noalias() +=
        block.transpose() * (beam_.segment<kLanes>(b * kLanes) * (active ? 1.0 : power_));
  }
  return profile;
}

Eigen::MatrixXd LayeredStepper::temperatures() const {
  const Modes& radial = model_->radial();
  Eigen::MatrixXd coordinates(radial.size(), cells_);
  for (Index i = 0; i < radial.size(); ++i) {
    for (Index j = 0; j < cells_; ++j) coordinates(i, j) = coordinate(i, j);
  }
  return radial.root_measure.cwiseInverse().asDiagonal() * (radial.vectors * coordinates) *
         model_->axial().root_measure.cwiseInverse().asDiagonal();
}

}  // namespace photocoag
