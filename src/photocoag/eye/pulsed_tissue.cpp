#include "photocoag/eye/pulsed_tissue.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/wide_vectors.hpp"
#include "photocoag/tissue/absorption.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Splits cells into `groups` consecutive ones of about equal weight: the group of each cell.
std::vector<Index> equal_groups(const VectorXd& weights, Index groups) {
  const double total = weights.sum();
  std::vector<Index> group(static_cast<std::size_t>(weights.size()));
  double before = 0.0;
  for (Index c = 0; c < weights.size(); ++c) {
    const double middle = (before + 0.5 * weights[c]) / total;
    group[static_cast<std::size_t>(c)] =
        std::min(static_cast<Index>(middle * static_cast<double>(groups)), groups - 1);
    before += weights[c];
  }
  return group;
}

// Rows: weighted means over each group of the cell values that a mode has. shares: the weights.
MatrixXd group_means(const Modes& modes, const VectorXd& weights, Index groups, VectorXd& shares) {
  const std::vector<Index> group = equal_groups(weights, groups);
  MatrixXd rows = MatrixXd::Zero(groups, modes.size());
  shares = VectorXd::Zero(groups);
  for (Index c = 0; c < weights.size(); ++c) {
    const Index g = group[static_cast<std::size_t>(c)];
    shares[g] += weights[c];
    rows.row(g) += weights[c] / modes.root_measure[c] * modes.vectors.row(c);
  }
  for (Index g = 0; g < groups; ++g) {
    if (shares[g] > 0.0) rows.row(g) /= shares[g];
  }
  shares /= shares.sum();
  return rows;
}

/// Sums over radial modes, per axial mode.
struct Profiles {
  double* axis;
  double* spot;
  double* axis_mean;
  double* spot_mean;
};

// The axial modes of one radial mode through a pulse and the period after it.
PHOTOCOAG_WIDE_VECTORS void advance(double* __restrict state, const double* __restrict decay,
                                    const double* __restrict share, Index modes, double energy,
                                    double axis_weight, double spot_weight,
                                    const Profiles& profiles) noexcept {
  double* __restrict axis = profiles.axis;
  double* __restrict spot = profiles.spot;
  double* __restrict axis_mean = profiles.axis_mean;
  double* __restrict spot_mean = profiles.spot_mean;
  for (Index j = 0; j < modes; ++j) {
    const double hot = state[j] + energy;
    const double next = decay[j] * hot;
    const double average = share[j] * hot;
    state[j] = next;
    axis[j] += axis_weight * next;
    spot[j] += spot_weight * next;
    axis_mean[j] += axis_weight * average;
    spot_mean[j] += spot_weight * average;
  }
}

PHOTOCOAG_WIDE_VECTORS void add_scaled(double* __restrict sum, const double* __restrict terms,
                                       Index count, double factor) noexcept {
  for (Index j = 0; j < count; ++j) sum[j] += factor * terms[j];
}

}  // namespace

PulsedTissue::PulsedTissue(std::shared_ptr<const FullOrderModel> model, double pulse_period,
                           AbsorptionFactors absorption, const GrueneisenCurve& curve)
    : model_(std::move(model)),
      curve_(curve),
      ambient_(model_->tissue().ambient_celsius),
      axis_weight_(model_->peak_radial().cwiseProduct(model_->beam())),
      spot_weight_(model_->beam().cwiseAbs2()) {
  if (!model_->separable()) {
    throw Error(ErrorParts{.key = "plant.tissue.layers",
                           .problem = "the pulsed eye needs layers that conduct alike",
                           .accepted = "no thermal data of single layers"});
  }
  const OutputWeights weights = model_->output_weights(absorption);
  const double absorbed = AbsorptionLaw(model_->tissue()).whole().evaluate(absorption).value;
  peak_weight_ = weights.peak;
  volume_weight_ = weights.volume * (model_->volume_norm(absorption) / absorbed);
  prepare_modes(pulse_period);
  if (!curve_.linear()) prepare_curved(absorption);
  state_.resize(decay_.size());
  axis_ = spot_ = axis_mean_ = spot_mean_ = VectorXd::Zero(model_->axial().size());
  reset();
}

void PulsedTissue::prepare_modes(double pulse_period) {
  constexpr double kGone = 1e-6;  // of the pulse's own 4 K: a few uK
  const VectorXd& radial = model_->radial().rates;
  const VectorXd& axial = model_->axial().rates;
  active_.assign(static_cast<std::size_t>(radial.size()), 0);
  VectorXd axis = VectorXd::Zero(axial.size());
  VectorXd spot = VectorXd::Zero(axial.size());
  for (Index i = 0; i < radial.size(); ++i) {
    // Rates ascend, so the modes with a state come first.
    for (Index j = 0; j < axial.size(); ++j) {
      const double exponent = (radial[i] + axial[j]) * pulse_period;
      const double decay = std::exp(-exponent);
      const double share = -std::expm1(-exponent) / exponent;
      if (decay >= kGone) {
        decay_.push_back(decay);
        share_.push_back(share);
        ++active_[static_cast<std::size_t>(i)];
      } else {
        axis[j] += axis_weight_[i] * share;
        spot[j] += spot_weight_[i] * share;
      }
    }
  }
  memoryless_mean_ = {.volume = volume_weight_.dot(spot), .peak = peak_weight_.dot(axis)};
  peak_gain_ = peak_weight_.sum() * axis_weight_.sum();
}

void PulsedTissue::prepare_curved(AbsorptionFactors absorption) {
  const Modes& radial = model_->radial();
  const Modes& axial = model_->axial();
  // Beam power per ring of cells.
  const VectorXd ring_power =
      radial.to_cells(model_->beam()).cwiseProduct(radial.root_measure.cwiseAbs2());
  ring_weight_ = group_means(radial, ring_power, kRings, ring_share_) * model_->beam().asDiagonal();
  const std::vector<AbsorbedFraction>& cells = model_->cell_absorption();
  VectorXd absorbed(static_cast<Index>(cells.size()));
  for (std::size_t c = 0; c < cells.size(); ++c) {
    absorbed[static_cast<Index>(c)] = cells[c].evaluate(absorption).value;
  }
  const VectorXd source = model_->axial_source(absorption) * model_->input_gain();
  const MatrixXd by_depth =
      group_means(axial, absorbed, kDepths, depth_share_) * source.asDiagonal();
  // Modes that contribute to a group's temperature at pulses of 0.1 W; they matter only for the
  // curvature.
  constexpr double kNegligibleRise = 1e-6;  // K
  constexpr double kLargestPulse = 1e-5;    // J
  felt_.assign(active_.size(), 0);
  std::size_t k = 0;
  for (Index i = 0; i < radial.size(); ++i) {
    const double ring = ring_weight_.col(i).cwiseAbs().maxCoeff();
    for (Index j = 0; j < active_[static_cast<std::size_t>(i)]; ++j, ++k) {
      const double steady = kLargestPulse * decay_[k] / (1.0 - decay_[k]);
      const double felt = ring * by_depth.col(j).cwiseAbs().maxCoeff() * steady;
      if (felt > kNegligibleRise) felt_[static_cast<std::size_t>(i)] = j + 1;
    }
  }
  ring_profile_ = MatrixXd::Zero(axial.size(), kRingsPerPulse);
  // One column per depth: contiguous sums.
  depth_weight_ = by_depth.leftCols(*std::max_element(felt_.begin(), felt_.end())).transpose();
}

void PulsedTissue::reset() noexcept {
  std::fill(state_.begin(), state_.end(), 0.0);
  ring_temperature_.setZero();
  ring_curve_.setConstant(curve_.value(ambient_));
  before_ = mean_ = {};
  peak_after_ = 0.0;
}

void PulsedTissue::pulse(double energy) noexcept {
  axis_.setZero();
  spot_.setZero();
  axis_mean_.setZero();
  spot_mean_.setZero();
  const Profiles profiles{axis_.data(), spot_.data(), axis_mean_.data(), spot_mean_.data()};
  std::size_t at = 0;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Index modes = active_[i];
    advance(state_.data() + at, decay_.data() + at, share_.data() + at, modes, energy,
            axis_weight_[static_cast<Index>(i)], spot_weight_[static_cast<Index>(i)], profiles);
    at += static_cast<std::size_t>(modes);
  }
  peak_after_ = before_.peak + peak_gain_ * energy;
  before_ = {.volume = volume_weight_.dot(spot_), .peak = peak_weight_.dot(axis_)};
  mean_ = {.volume = volume_weight_.dot(spot_mean_) + memoryless_mean_.volume * energy,
           .peak = peak_weight_.dot(axis_mean_) + memoryless_mean_.peak * energy};
}

double PulsedTissue::signal() noexcept {
  const double mean = curve_.value(ambient_ + before_.volume);
  if (curve_.linear()) return mean;  // the mean of the curve is the curve of the mean
  // Two rings per pulse: the curvature term changes little within three pulses, and the time is
  // bounded.
  ring_profile_.setZero();
  const Index first = next_ring_;
  next_ring_ = (next_ring_ + kRingsPerPulse) % kRings;
  const double* state = state_.data();
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Index modes = felt_[i];
    for (Index k = 0; k < kRingsPerPulse; ++k) {
      add_scaled(ring_profile_.col(k).data(), state, modes,
                 ring_weight_(first + k, static_cast<Index>(i)));
    }
    state += active_[i];
  }
  for (Index k = first; k < first + kRingsPerPulse; ++k) {
    const auto profile = ring_profile_.col(k - first).head(depth_weight_.rows());
    double& of_curve = ring_curve_[k];
    double& of_temperature = ring_temperature_[k];
    of_curve = of_temperature = 0.0;
    for (Index g = 0; g < kDepths; ++g) {
      const double temperature = depth_weight_.col(g).dot(profile);
      of_curve += depth_share_[g] * curve_.value(ambient_ + temperature);
      of_temperature += depth_share_[g] * temperature;
    }
  }
  // Only the curvature term comes from the groups; the mean itself is exact.
  return mean + ring_share_.dot(ring_curve_) -
         curve_.value(ambient_ + ring_share_.dot(ring_temperature_));
}

}  // namespace photocoag
