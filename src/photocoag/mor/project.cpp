#include "photocoag/mor/project.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Fixes the sign of each state so that its weight in the peak output is not negative.
void fix_signs(const ImpulseSpace& space, MatrixXd& trial, MatrixXd& test) {
  for (Index k = 0; k < trial.cols(); ++k) {
    if (trial.col(k).dot(space.peak) < 0.0) {
      trial.col(k) *= -1.0;
      test.col(k) *= -1.0;
    }
  }
}

// V'AV is symmetric negative definite with A: its eigenvectors make it diagonal.
MatrixXd diagonalise_symmetric(const ImpulseSpace& space, MatrixXd& trial, MatrixXd& test) {
  const MatrixXd projected = trial.transpose() * space.rates.asDiagonal() * trial;
  const SymmetricEigen<double> diagonal =
      symmetric_eigen(MatrixXd(0.5 * (projected + projected.transpose())));
  trial = trial * diagonal.vectors;
  test = trial;
  fix_signs(space, trial, test);
  return (-diagonal.values).asDiagonal();
}

MatrixXd diagonalise_general(const ImpulseSpace& space, MatrixXd& trial, MatrixXd& test) {
  constexpr double kWellConditioned = 1e6;
  const MatrixXd projected = -(test.transpose() * space.rates.asDiagonal() * trial);
  const GeneralEigen eigen = general_eigen(projected);
  if (!eigen.converged || eigen.values.real().maxCoeff() >= 0.0) {
    throw Error("the projected model is not stable");
  }
  if (eigen.values.imag().cwiseAbs().maxCoeff() > 0.0) return projected;
  const VectorXd values = eigen.values.real();
  std::vector<Index> slowest_first(values.size());
  std::iota(slowest_first.begin(), slowest_first.end(), Index{0});
  std::sort(slowest_first.begin(), slowest_first.end(),
            [&values](Index i, Index j) { return values[i] > values[j]; });
  const MatrixXd vectors = eigen.vectors.real()(Eigen::all, slowest_first);
  const VectorXd singular = singular_values(vectors);
  if (singular[0] > kWellConditioned * singular[singular.size() - 1]) return projected;
  trial = trial * vectors;
  test = test * inverse(vectors).transpose();
  fix_signs(space, trial, test);
  return VectorXd(values(slowest_first)).asDiagonal();
}

}  // namespace

MatrixXd project(const FullOrderModel& full, const ImpulseSpace& space, const Bases& bases,
                 const ParametricSource& source, ReducedModel& model) {
  MatrixXd trial = bases.trial;
  MatrixXd test = bases.test;
  model.A = bases.galerkin ? diagonalise_symmetric(space, trial, test)
                           : diagonalise_general(space, trial, test);
  model.theta = source.theta;
  // test' b_j and c_j trial: the volume output is the input's adjoint.
  const MatrixXd input = test.transpose() * space.axial_source * source.sources;
  model.B = full.input_gain() * input;
  model.C_volume =
      bases.galerkin
          ? MatrixXd(input.transpose())
          : MatrixXd((trial.transpose() * space.axial_source * source.sources).transpose());
  model.C_peak = trial.transpose() * space.peak;
  return trial;
}

}  // namespace photocoag
