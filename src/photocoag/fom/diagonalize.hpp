// Role: offline; how a full-order model diagonalises its directions. Used by fom, run (which keeps
// eigenpairs in files). Threads: each has its own choice.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

/// The eigenpairs of a symmetric tridiagonal matrix, as tridiagonal_eigen() gives them.
using Diagonalize = std::function<SymmetricEigen<double>(const Eigen::VectorXd& diagonal,
                                                         const Eigen::VectorXd& off_diagonal)>;

/// While it lives, models that this thread builds use `how`, which must live as long.
class DiagonalizeWith {
 public:
  explicit DiagonalizeWith(const Diagonalize& how) noexcept;
  ~DiagonalizeWith();
  DiagonalizeWith(const DiagonalizeWith&) = delete;
  DiagonalizeWith& operator=(const DiagonalizeWith&) = delete;

 private:
  const Diagonalize* before_;
};

/// With what is chosen, else tridiagonal_eigen().
SymmetricEigen<double> diagonalize(const Eigen::VectorXd& diagonal,
                                   const Eigen::VectorXd& off_diagonal);

}  // namespace photocoag
