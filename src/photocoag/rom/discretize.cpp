#include "photocoag/rom/discretize.hpp"

#include "photocoag/core/linear_algebra.hpp"

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

}  // namespace photocoag
