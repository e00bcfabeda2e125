#include "photocoag/mor/reconstruct.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXd;

ReconstructingModel reconstructing_model(const FullOrderModel& full,
                                         const ReductionSettings& settings, double period,
                                         Discretization discretization) {
  ReconstructingModel result{{}, reduction_space(full, settings), {}};
  result.model = project_model(full, result.space, settings, period, discretization, &result.trial);
  return result;
}

MatrixXd reconstruct(const FullOrderModel& full, const ReconstructingModel& reduced,
                     const Eigen::VectorXd& state) {
  MatrixXd cells = reduced.space.lift(reduced.trial * state);
  for (Index j = 0; j < cells.cols(); ++j) cells.col(j) = full.radial().to_cells(cells.col(j));
  for (Index i = 0; i < cells.rows(); ++i) {
    cells.row(i) = full.axial().to_cells(cells.row(i).transpose()).transpose();
  }
  return cells;
}

}  // namespace photocoag
