// Role: benchmarks; the alternative to the modal stepper: implicit Euler with a sparse Cholesky
// factorisation, made once, one solve per step.
#pragma once

#include <Eigen/SparseCholesky>
#include <memory>

#include "photocoag/fom/sparse_system.hpp"

namespace photocoag::benchmarks {

/// (E - h A) T+ = E (T + h b u) for one step length: the left side, symmetric positive definite.
Eigen::SparseMatrix<double> implicit_euler_matrix(const SparseSystem& system, double period);

/// Eigen's own, with its default ordering (AMD).
class EigenCholesky {
 public:
  explicit EigenCholesky(const Eigen::SparseMatrix<double>& matrix) : solver_(matrix) {}
  void solve(const Eigen::VectorXd& right, Eigen::VectorXd& solution) {
    solution = solver_.solve(right);
  }
  double factor_entries() const {
    return static_cast<double>(solver_.matrixL().nestedExpression().nonZeros());
  }

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

#ifdef PHOTOCOAG_HAVE_CHOLMOD
/// CHOLMOD with the best of the orderings that it tries; repeated solves reuse their workspace.
class CholmodCholesky {
 public:
  CholmodCholesky(const Eigen::SparseMatrix<double>& matrix, bool supernodal);
  ~CholmodCholesky();
  CholmodCholesky(const CholmodCholesky&) = delete;
  CholmodCholesky& operator=(const CholmodCholesky&) = delete;

  void solve(const Eigen::VectorXd& right, Eigen::VectorXd& solution);
  double factor_entries() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};
#endif

}  // namespace photocoag::benchmarks
