#include "photocoag/certify/sampled_problem.hpp"

#include <algorithm>

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mpc/ocp.hpp"

namespace photocoag {

SampledProblem::SampledProblem(const ReducedModel& model, const ControlSettings& settings,
                               long long cycle)
    : model_(model), settings_(settings), cycle_(cycle) {
  const int n = settings.horizon - 1;
  rows_[0] = model.C_peak;
  for (int i = 1; i < n; ++i) rows_[i] = (rows_[i - 1].transpose() * model.A_d).transpose().eval();
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(model.order(), model.order()) - Eigen::MatrixXd(model.A_d);
  steady_row_ = StateVector(solve_transposed(rest, Eigen::VectorXd(model.C_peak)));
  problem_.resize(n, n);
  problem_.lower.setConstant(settings.power_min / settings.power_max);
  problem_.upper.setConstant(1.0);
}

const QpProblem& SampledProblem::at(const ParameterPoint& point) {
  const int n = settings_.horizon - 1;
  const double scale = settings_.power_max;
  const double r1 = settings_.power_weight * scale * scale;
  const double r2 = settings_.power_change_weight * scale * scale;
  model_.evaluate({point.absorption, point.choroid}, matrices_);
  const double reference = settings_.peak_reference / steady_row_.dot(matrices_.input) / scale;
  InputMatrix& g = problem_.rows;
  g.setZero();
  for (int i = 0; i < n; ++i) {
    const double h = rows_[i].dot(matrices_.input) * scale;
    for (int j = 0; i + j < n; ++j) g(i + j, j) = h;
  }
  problem_.gradient.setConstant(-2.0 * r1 * reference);
  problem_.hessian.setZero();
  for (int k = 0; k < n; ++k) {
    const double least = point.free[k] + g.row(k).sum() * problem_.lower[0];
    problem_.limit[k] = std::max(settings_.peak_max, least) - point.free[k];
    const double weight = 2.0 * state_weight(settings_.state_weight, cycle_ + k + 1);
    for (int j = 0; j <= k; ++j) {
      problem_.gradient[j] += weight * g(k, j) * (point.free[k] - settings_.peak_reference);
      for (int l = 0; l <= k; ++l) problem_.hessian(j, l) += weight * g(k, j) * g(k, l);
    }
  }
  for (int j = 0; j < n; ++j) {
    problem_.hessian(j, j) += 2.0 * (r1 + (j + 1 < n ? 2.0 * r2 : r2));
    if (j == 0) continue;
    problem_.hessian(j, j - 1) -= 2.0 * r2;
    problem_.hessian(j - 1, j) -= 2.0 * r2;
  }
  problem_.gradient[0] -= 2.0 * r2 * point.previous / scale;
  return problem_;
}

int SampledProblem::changes(const ParameterPoint& point) {
  solver_.solve(at(point), solution_);
  return solution_.iterations;
}

}  // namespace photocoag
