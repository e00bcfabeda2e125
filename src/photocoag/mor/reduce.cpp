#include "photocoag/mor/reduce.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "photocoag/mor/deim.hpp"
#include "photocoag/mor/impulse_space.hpp"
#include "photocoag/mor/pod.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kDeimTerms = 5;

std::vector<double> log_spaced(double first, double last, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(first * std::pow(last / first, double(i) / (count - 1)));
  }
  return values;
}

// Absorbed fractions per axial cell, in the norm of the energy product (divided by the root of the
// width).
MatrixXd source_snapshots(const FullOrderModel& full, const std::vector<double>& alphas) {
  const auto& cells = full.cell_absorption();
  MatrixXd snapshots(static_cast<Index>(cells.size()), static_cast<Index>(alphas.size()));
  for (Index a = 0; a < snapshots.cols(); ++a) {
    for (Index j = 0; j < snapshots.rows(); ++j) {
      snapshots(j, a) = cells[j].evaluate(alphas[a]).value / full.axial().root_measure[j];
    }
  }
  return snapshots;
}

// theta_j(alpha) = absorbed fraction of dof j; returns the axial source (coordinates) of each
// theta_j.
MatrixXd interpolate_source(const FullOrderModel& full, Theta& theta) {
  // Over the estimator's widest range of alpha, so that theta is right wherever the filter may
  // look.
  const Deim points = deim(source_snapshots(full, log_spaced(0.2, 2.0, 40)), kDeimTerms);
  theta.terms = static_cast<int>(points.dofs.size());
  const VectorXd& root = full.axial().root_measure;
  MatrixXd sources(full.axial().size(), theta.terms);
  for (Index j = 0; j < sources.cols(); ++j) {
    const Index dof = points.dofs[j];
    theta.points[j] = full.cell_absorption()[dof];
    sources.col(j) =
        full.axial_source(VectorXd(points.interpolation.col(j).cwiseProduct(root) / root[dof]));
  }
  return sources;
}

}  // namespace

ReducedModel reduce(std::shared_ptr<const FullOrderModel> full, const ReductionSettings& settings,
                    double period, Discretization discretization, const Progress& progress) {
  settings.validate();
  const auto report = [&progress](std::string_view stage, double fraction) {
    if (progress) progress(stage, fraction);
  };
  report("collecting impulse responses", 0.0);
  const ImpulseSpace space = impulse_space(*full, log_spaced(0.25, 2.0, 8));
  report("choosing the basis", 0.5);
  const MatrixXd basis = pod_basis(*full, space, settings.order);

  // Galerkin: V'AV is symmetric negative definite with A. Its eigenvectors make it diagonal; each
  // is turned so that the peak output's weight is not negative, which fixes the sign.
  const MatrixXd projected = basis.transpose() * space.rates.asDiagonal() * basis;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> diagonal(0.5 * (projected + projected.transpose()));
  MatrixXd rotation = basis * diagonal.eigenvectors();
  for (Index k = 0; k < rotation.cols(); ++k) {
    if (rotation.col(k).dot(space.peak) < 0.0) rotation.col(k) *= -1.0;
  }

  ReducedModel model;
  const MatrixXd sources = interpolate_source(*full, model.theta);
  const MatrixXd coupling = rotation.transpose() * space.axial_source * sources;  // V' b_j
  model.A = StateMatrix((-diagonal.eigenvalues()).asDiagonal());
  model.B = full->input_gain() * coupling;
  model.C_volume = coupling.transpose();  // the volume output is the input's adjoint
  model.C_peak = rotation.transpose() * space.peak;
  model.tissue = full->tissue();
  model.volume_normalized = model.tissue.volume_temperature == VolumeTemperature::kNormalized;
  model.whole = AbsorptionLaw(model.tissue).whole();
  model.method = to_string(settings.method);
  model.theta_kind = "deim";
  model.full_order_states = full->states();
  model.discretize(period, discretization);
  verify(model);
  model.error = measure_error(model, full, {}, [&report](std::string_view stage, double fraction) {
    report(stage, 0.6 + 0.4 * fraction);
  });
  report("done", 1.0);
  return model;
}

}  // namespace photocoag
