// Role: offline; how a full-order model diagonalises its two directions. Used by fom, run (which
// caches eigenpairs in files). Threads: the choice is per thread.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

/// The eigenpairs of a symmetric tridiagonal matrix, as tridiagonal_eigen() gives them.
using Diagonalize = std::function<SymmetricEigen<double>(const Eigen::VectorXd& diagonal,
                                                         const Eigen::VectorXd& off_diagonal)>;

/// During its lifetime models built by this thread use `how`, which must outlive it.
class DiagonalizeWith {
 public:
  explicit DiagonalizeWith(const Diagonalize& how) noexcept;
  ~DiagonalizeWith();
  DiagonalizeWith(const DiagonalizeWith&) = delete;
  DiagonalizeWith& operator=(const DiagonalizeWith&) = delete;

 private:
  const Diagonalize* before_;
};

/// By the chosen function, else tridiagonal_eigen().
SymmetricEigen<double> diagonalize(const Eigen::VectorXd& diagonal,
                                   const Eigen::VectorXd& off_diagonal);

}  // namespace photocoag
