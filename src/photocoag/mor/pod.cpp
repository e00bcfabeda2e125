#include "photocoag/mor/pod.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The method's hyperparameters, tuned once by a random search on the paper's tissue: smallest
// worst error over on/off powers of many dwell times and smallest L1 norm of the impulse response's
// error, at 1 ms and at 4 ms. The search put nearly all weight on the two ends of the range of
// alpha. None of these alphas is among those on which the error is measured.
struct SnapshotAlpha {
  double value;
  double weight;
};
constexpr std::array<SnapshotAlpha, 3> kSnapshotAlphas{{{0.295, 4.5}, {0.384, 0.9}, {1.72, 5.5}}};

// Weight of a snapshot at time t: t^0.6 times the exponential of this piecewise linear function of
// log10 t.
constexpr std::array<double, 6> kDecadeWeight{-0.25, 1.20, 0.60, 0.79, 0.56, -2.2};
constexpr double kFirstDecade = -5.0;  // 10 us … 1 s
constexpr int kSnapshotTimes = 60;

double snapshot_weight(double log10_time) {
  const double position = std::clamp(log10_time - kFirstDecade, 0.0, 5.0);
  const auto below = std::min(static_cast<std::size_t>(position), kDecadeWeight.size() - 2);
  const double fraction = position - static_cast<double>(below);
  const double log_weight =
      (1.0 - fraction) * kDecadeWeight[below] + fraction * kDecadeWeight[below + 1];
  return std::exp(log_weight) * std::pow(10.0, 0.6 * log10_time);
}

}  // namespace

MatrixXd weighted_impulse_response(const ImpulseSpace& space, const VectorXd& input,
                                   double weight) {
  MatrixXd snapshots(space.size(), kSnapshotTimes);
  for (int i = 0; i < kSnapshotTimes; ++i) {
    const double log10_time = kFirstDecade + 5.0 * i / (kSnapshotTimes - 1);
    const VectorXd decay = (-space.rates * std::pow(10.0, log10_time)).array().exp();
    snapshots.col(i) = snapshot_weight(log10_time) * decay.cwiseProduct(input);
  }
  snapshots *= weight / snapshots.norm();
  return snapshots;
}

MatrixXd leading_directions(const MatrixXd& snapshots, int order) {
  if (order > std::min(snapshots.rows(), snapshots.cols())) {
    throw Error(ErrorParts{.key = "model.order",
                           .found = fmt::format("{}", order),
                           .accepted = fmt::format("at most {} for this tissue",
                                                   std::min(snapshots.rows(), snapshots.cols()))});
  }
  return left_svd(snapshots).U.leftCols(order);
}

MatrixXd pod_basis(const FullOrderModel& model, const ImpulseSpace& space, int order,
                   const std::vector<double>& betas) {
  MatrixXd snapshots(space.size(),
                     kSnapshotTimes * static_cast<Index>(kSnapshotAlphas.size() * betas.size()));
  Index column = 0;
  for (const double beta : betas) {
    for (const SnapshotAlpha& alpha : kSnapshotAlphas) {
      const VectorXd input =
          space.axial_source * model.axial_source(AbsorptionFactors{alpha.value, beta});
      snapshots.middleCols(column, kSnapshotTimes) =
          weighted_impulse_response(space, input, alpha.weight);
      column += kSnapshotTimes;
    }
  }
  return leading_directions(snapshots, order);
}

}  // namespace photocoag
