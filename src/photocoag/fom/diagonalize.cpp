#include "photocoag/fom/diagonalize.hpp"

namespace photocoag {
namespace {

const Diagonalize*& chosen() noexcept {
  thread_local const Diagonalize* how = nullptr;
  return how;
}

}  // namespace

DiagonalizeWith::DiagonalizeWith(const Diagonalize& how) noexcept : before_(chosen()) {
  chosen() = &how;
}

DiagonalizeWith::~DiagonalizeWith() { chosen() = before_; }

SymmetricEigen<double> diagonalize(const Eigen::VectorXd& diagonal,
                                   const Eigen::VectorXd& off_diagonal) {
  const Diagonalize* how = chosen();
  return how == nullptr ? tridiagonal_eigen(diagonal, off_diagonal)
                        : (*how)(diagonal, off_diagonal);
}

}  // namespace photocoag
