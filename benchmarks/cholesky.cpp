#include "cholesky.hpp"

#include <algorithm>

#include "photocoag/core/error.hpp"

#ifdef PHOTOCOAG_HAVE_CHOLMOD
#include <cholmod.h>
#endif

namespace photocoag::benchmarks {

Eigen::SparseMatrix<double> implicit_euler_matrix(const SparseSystem& system, double period) {
  Eigen::SparseMatrix<double> matrix = -period * system.A;
  matrix.diagonal() += system.E;
  matrix.makeCompressed();
  return matrix;
}

#ifdef PHOTOCOAG_HAVE_CHOLMOD

struct CholmodCholesky::State {
  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense* solution = nullptr;
  cholmod_dense* work_y = nullptr;
  cholmod_dense* work_e = nullptr;
};

namespace {

// A view of Eigen's lower triangle; nothing is copied.
cholmod_sparse view_of(Eigen::SparseMatrix<double>& lower) {
  cholmod_sparse view{};
  view.nrow = static_cast<std::size_t>(lower.rows());
  view.ncol = static_cast<std::size_t>(lower.cols());
  view.nzmax = static_cast<std::size_t>(lower.nonZeros());
  view.p = lower.outerIndexPtr();
  view.i = lower.innerIndexPtr();
  view.x = lower.valuePtr();
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

}  // namespace

CholmodCholesky::CholmodCholesky(const Eigen::SparseMatrix<double>& matrix, bool supernodal)
    : state_(std::make_unique<State>()) {
  cholmod_start(&state_->common);
  state_->common.supernodal = supernodal ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
  Eigen::SparseMatrix<double> lower = matrix.triangularView<Eigen::Lower>();
  cholmod_sparse view = view_of(lower);
  state_->factor = cholmod_analyze(&view, &state_->common);
  if (state_->factor == nullptr || cholmod_factorize(&view, state_->factor, &state_->common) == 0 ||
      state_->common.status != CHOLMOD_OK) {
    throw Error("CHOLMOD could not factorise the matrix");
  }
}

CholmodCholesky::~CholmodCholesky() {
  cholmod_common* common = &state_->common;
  cholmod_free_dense(&state_->solution, common);
  cholmod_free_dense(&state_->work_y, common);
  cholmod_free_dense(&state_->work_e, common);
  cholmod_free_factor(&state_->factor, common);
  cholmod_finish(common);
}

void CholmodCholesky::solve(const Eigen::VectorXd& right, Eigen::VectorXd& solution) {
  const auto size = static_cast<std::size_t>(right.size());
  cholmod_dense view{};
  view.nrow = size;
  view.ncol = 1;
  view.nzmax = size;
  view.d = size;
  view.x = const_cast<double*>(right.data());  // CHOLMOD reads it only
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  cholmod_solve2(CHOLMOD_A, state_->factor, &view, nullptr, &state_->solution, nullptr,
                 &state_->work_y, &state_->work_e, &state_->common);
  const auto* values = static_cast<const double*>(state_->solution->x);
  solution = Eigen::Map<const Eigen::VectorXd>(values, right.size());
}

double CholmodCholesky::factor_entries() const {
  return state_->factor->is_super ? static_cast<double>(state_->factor->xsize)
                                  : static_cast<double>(state_->factor->nzmax);
}

#endif

}  // namespace photocoag::benchmarks
