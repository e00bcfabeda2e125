#include "photocoag/mor/full_impulse.hpp"

#include <future>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

SymmetricEigen<double> depth_modes(const FullOrderModel& full, Index radial_mode) {
  const DepthOperator& depth = full.depth_operator();
  SymmetricEigen<double> eigen = tridiagonal_eigen(
      full.radial().rates[radial_mode] * depth.diffusivity + depth.diagonal, depth.off_diagonal);
  if (!eigen.converged) throw Error("the heat operator in depth could not be diagonalised");
  return eigen;
}

NodeValues zero_values(const FactorNodes& nodes) {
  const VectorXd zero = VectorXd::Zero(nodes.size());
  return {zero, zero, nodes.two_parameters() ? zero : VectorXd()};
}

// What the profiles' first `active` entries, the others being 0, give at the nodes.
void evaluate(const OutputExpansion<double>& x, const VectorXd& profile, const VectorXd& magnitude,
              Index active, NodeValues& out) {
  const auto p = profile.head(active);
  const auto m = magnitude.head(active);
  out.value.noalias() = x.value.leftCols(active) * p;
  out.second_alpha.noalias() = x.second_alpha.leftCols(active) * p;
  out.fourth_alpha = x.fourth.alpha.head(active).dot(m);
  if (x.second_beta.size() == 0) return;
  out.second_beta.noalias() = x.second_beta.leftCols(active) * p;
  out.fourth_mixed = x.fourth.mixed.head(active).dot(m);
  out.fourth_beta = x.fourth.beta.head(active).dot(m);
}

void add(const NodeValues& more, NodeValues& sum) {
  sum.value += more.value;
  sum.second_alpha += more.second_alpha;
  sum.second_beta += more.second_beta;
  sum.fourth_alpha += more.fourth_alpha;
  sum.fourth_mixed += more.fourth_mixed;
  sum.fourth_beta += more.fourth_beta;
}

}  // namespace

// Radial modes with their common axial modes.
struct FullImpulse::Group {
  ErrorExpansion<double> expansion;
  PulseResponse pulse;

  // Of a separable model: all of it.
  Group(const FullOrderModel& full, Discretization discretization, double period,
        const FullExpansion& sources)
      : expansion(sources.over(full.axial().vectors, full.peak_axial())),
        pulse({.rates = full.axial().rates.replicate(1, full.radial().size()).rowwise() +
                        full.radial().rates.transpose(),
               .axis_weight = full.peak_radial().cwiseProduct(full.beam()),
               .spot_weight = full.beam().cwiseAbs2()},
              discretization, period) {}

  // Of one radial mode, whose axial modes are `axial`.
  Group(const FullOrderModel& full, Index mode, const SymmetricEigen<double>& axial,
        Discretization discretization, double period, const FullExpansion& sources)
      : expansion(sources.over(axial.vectors, axial.vectors.transpose() * full.peak_axial())),
        pulse({.rates = axial.values,
               .axis_weight = VectorXd::Constant(1, full.peak_radial()[mode] * full.beam()[mode]),
               .spot_weight = VectorXd::Constant(1, full.beam()[mode] * full.beam()[mode])},
              discretization, period) {}

  void evaluate_all(const AxialProfiles& profiles, Index active, OutputNodeValues& out) const {
    evaluate(expansion.peak, profiles.axis, profiles.axis_magnitude, active, out.peak);
    evaluate(expansion.volume, profiles.spot, profiles.spot, active, out.volume);
  }

  OutputBounds bounds(const AxialProfiles& profiles) const {
    return {expansion.peak.bound.dot(profiles.axis_magnitude),
            expansion.volume.bound.dot(profiles.spot)};
  }
};

// NodeValues of every k, one column each.
struct FullImpulse::Columns {
  struct Output {
    MatrixXd value;
    MatrixXd second_alpha;
    MatrixXd second_beta;
    MatrixXd fourth;  // 3 x horizon

    Output(const FactorNodes& nodes, Index horizon)
        : value(MatrixXd::Zero(nodes.size(), horizon)),
          second_alpha(value),
          second_beta(MatrixXd::Zero(nodes.two_parameters() ? nodes.size() : 0, horizon)),
          fourth(MatrixXd::Zero(3, horizon)) {}

    void add(const NodeValues& more, Index column) {
      value.col(column) += more.value;
      second_alpha.col(column) += more.second_alpha;
      second_beta.col(column) += more.second_beta;
      fourth.col(column) += Eigen::Vector3d(more.fourth_alpha, more.fourth_mixed, more.fourth_beta);
    }

    NodeValues at(Index column) const {
      return {value.col(column), second_alpha.col(column), second_beta.col(column),
              fourth(0, column), fourth(1, column),        fourth(2, column)};
    }
  };

  Output peak;
  Output volume;

  Columns(const FactorNodes& nodes, Index horizon) : peak(nodes, horizon), volume(nodes, horizon) {}

  OutputNodeValues at(std::size_t k) const {
    const auto column = static_cast<Index>(k) - 1;
    return {peak.at(column), volume.at(column)};
  }
};

FullImpulse::FullImpulse(const FullOrderModel& full, Discretization discretization, double period,
                         const FactorNodes& nodes, std::size_t horizon)
    : horizon_(horizon),
      now_{zero_values(nodes), zero_values(nodes)},
      steady_{zero_values(nodes), zero_values(nodes)} {
  const FullExpansion sources(full, nodes);
  if (full.separable()) {
    one_ = std::make_unique<Group>(full, discretization, period, sources);
    add_sums(*one_);
    one_->evaluate_all(one_->pulse.profiles(), one_->pulse.active(), now_);
    return;
  }
  columns_ = std::make_unique<Columns>(nodes, static_cast<Index>(horizon));
  OutputNodeValues one = now_;
  const auto modes_of = [&full](Index mode) {
    return std::async(std::launch::async, [&full, mode] { return depth_modes(full, mode); });
  };
  std::future<SymmetricEigen<double>> next = modes_of(0);
  for (Index mode = 0; mode < full.radial().size(); ++mode) {
    const SymmetricEigen<double> axial = next.get();
    if (mode + 1 < full.radial().size()) next = modes_of(mode + 1);
    Group group(full, mode, axial, discretization, period, sources);
    add_sums(group);
    for (Index k = 0; k < static_cast<Index>(horizon) && group.pulse.active() > 0; ++k) {
      group.evaluate_all(group.pulse.profiles(), group.pulse.active(), one);
      columns_->peak.add(one.peak, k);
      columns_->volume.add(one.volume, k);
      group.pulse.advance();
    }
    const OutputBounds beyond = group.bounds(group.pulse.profiles());
    first_beyond_.peak += beyond.peak;
    first_beyond_.volume += beyond.volume;
  }
  now_ = columns_->at(k_);
}

FullImpulse::~FullImpulse() = default;

void FullImpulse::add_sums(const Group& group) {
  const AxialProfiles all = group.pulse.sum_after(0.0);
  OutputNodeValues one = now_;
  group.evaluate_all(all, all.axis.size(), one);
  add(one.peak, steady_.peak);
  add(one.volume, steady_.volume);
  const OutputBounds rest = group.bounds(group.pulse.sum_after(static_cast<double>(horizon_)));
  rest_.peak += rest.peak;
  rest_.volume += rest.volume;
}

void FullImpulse::advance() {
  ++k_;
  if (columns_) {
    if (k_ <= horizon_) now_ = columns_->at(k_);
    return;
  }
  one_->pulse.advance();
  if (k_ > horizon_) {
    first_beyond_ = one_->bounds(one_->pulse.profiles());
  } else {
    one_->evaluate_all(one_->pulse.profiles(), one_->pulse.active(), now_);
  }
}

double slowest_decay(const FullOrderModel& full, Discretization discretization, double period) {
  const double rate = full.separable() ? full.radial().rates[0] + full.axial().rates[0]
                                       : depth_modes(full, 0).values[0];
  return mode_decay(rate, discretization, period);
}

}  // namespace photocoag
