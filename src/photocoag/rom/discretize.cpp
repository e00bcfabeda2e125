#include "photocoag/rom/discretize.hpp"

#include <Eigen/LU>
#include <unsupported/Eigen/MatrixFunctions>

namespace photocoag {

DiscretePair discretize(const Eigen::MatrixXd& A, double period, Discretization how) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  if (how == Discretization::kImplicitEuler) {
    const Eigen::MatrixXd inverse = (identity - period * A).partialPivLu().inverse();
    return {inverse, period * inverse};
  }
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  block.topLeftCorner(n, n) = period * A;
  block.topRightCorner(n, n) = period * identity;
  const Eigen::MatrixXd exponential = block.exp();
  return {exponential.topLeftCorner(n, n), exponential.topRightCorner(n, n)};
}

}  // namespace photocoag
