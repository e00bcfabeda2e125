#include "photocoag/rom/discretize.hpp"

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

DiscretePair discretize(const Eigen::MatrixXd& A, double period, Discretization how) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  if (how == Discretization::kImplicitEuler) {
    const Eigen::MatrixXd transition = inverse(identity - period * A);
    return {transition, period * transition};
  }
  if (how == Discretization::kTrBdf2) {
    const double shift = TrBdf2::kShift * period;
    const Eigen::MatrixXd stage = inverse(identity - shift * A);
    const Eigen::MatrixXd mean = TrBdf2::kMix * stage + (1.0 - TrBdf2::kMix) * identity;
    return {stage * mean, shift * (stage * (TrBdf2::kMix * stage + identity))};
  }
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = period * A;
  block.topRightCorner(n, n) = period * identity;
  const Eigen::MatrixXd grown = exponential(block);
  return {grown.topLeftCorner(n, n), grown.topRightCorner(n, n)};
}

ReducedModel with_shown_states(const ReducedModel& model, const Eigen::MatrixXd& before,
                               const Eigen::MatrixXd& power) {
  const Eigen::Index n = model.order();
  const Eigen::Index terms = model.B_d.cols();
  ReducedModel twice = model;
  twice.A = StateMatrix::Zero(2 * n, 2 * n);
  twice.A.topLeftCorner(n, n) = model.A;
  twice.A.bottomRightCorner(n, n) = model.A;
  twice.B = InputTerms::Zero(2 * n, terms);
  twice.B.topRows(n) = model.B;
  twice.A_d = StateMatrix::Zero(2 * n, 2 * n);
  twice.A_d.topLeftCorner(n, n) = model.A_d;
  twice.A_d.bottomLeftCorner(n, n) = before;
  twice.B_d = InputTerms::Zero(2 * n, terms);
  twice.B_d.topRows(n) = model.B_d;
  twice.B_d.bottomRows(n) = power;
  twice.C_volume = OutputTerms::Zero(model.C_volume.rows(), 2 * n);
  twice.C_volume.rightCols(n) = model.C_volume;
  twice.C_peak = StateVector::Zero(2 * n);
  twice.C_peak.head(n) = model.C_peak;
  return twice;
}

}  // namespace photocoag
