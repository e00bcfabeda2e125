#include "photocoag/qp/kkt.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/qp/tolerances.hpp"

namespace photocoag {
namespace {

constexpr double kStationary = 1e-11;  // of the terms that cancel; 1e-15 is usual

// max(worst, value), but infinity for NaN, and that stays.
double worse(double worst, double value) noexcept {
  return value > worst ? value : (value <= worst ? worst : kInfinity);
}

double relative(double value, double scale) noexcept {
  if (value == 0.0) return 0.0;
  return scale < kInfinity ? value / scale : kInfinity;
}

// n inputs and n rows, or any number of either.
template <typename Inputs, typename Rows>
double inner_residual_as(Inputs inputs, Rows rows, const QpProblem& problem,
                         const double* __restrict u) noexcept {
  const int n = inputs;
  const int m = rows;
  const double* __restrict gradient = problem.gradient.data();
  const double* __restrict lower = problem.lower.data();
  const double* __restrict upper = problem.upper.data();
  double residual[even(kMaxInputs)];  // H u + g
  double terms[even(kMaxInputs)];
  double value[even(kMaxInputs)];  // G u
  bool good = true;
  for (int j = 0; j < n; ++j) {
    residual[j] = gradient[j];
    terms[j] = std::abs(gradient[j]);
    good &= u[j] >= lower[j] && u[j] <= upper[j] && lower[j] > -kInfinity && upper[j] < kInfinity;
  }
  if (!good) return kInfinity;
  for (int i = 0; i < m; ++i) value[i] = 0.0;
  for (int j = 0; j < n; ++j) {
    const double power = u[j];
    const double* __restrict column = problem.hessian.data() + j * n;
    for (int i = 0; i < n; ++i) {
      const double term = column[i] * power;
      residual[i] += term;
      terms[i] += std::abs(term);
    }
    const double* __restrict row = problem.rows.data() + j * m;
    for (int i = 0; i < m; ++i) value[i] += row[i] * power;
  }
  for (int i = 0; i < m; ++i) good &= value[i] > -kInfinity && value[i] <= problem.limit.data()[i];
  double worst = 0.0;
  for (int j = 0; j < n; ++j) {
    good &= terms[j] < kInfinity;  // false for NaN; |residual| <= terms
    const double error = std::abs(residual[j]);
    if (error > worst * terms[j]) worst = error / terms[j];
  }
  return good ? worst : kInfinity;
}

// n inputs and n rows, or any number of either.
template <typename Inputs, typename Rows>
KktResidual evaluate_as(Inputs inputs, Rows rows, const QpProblem& problem,
                        const QpSolution& solution) noexcept {
  const int n = inputs;
  const int m = rows;
  const double* __restrict gradient = problem.gradient.data();
  const double* __restrict lower = problem.lower.data();
  const double* __restrict upper = problem.upper.data();
  const double* __restrict limit = problem.limit.data();
  const double* __restrict u = solution.power.data();
  const double* __restrict bound_multiplier = solution.bound_multiplier.data();
  const double* __restrict row_multiplier = solution.row_multiplier.data();
  double residual[even(kMaxInputs)];
  double terms[even(kMaxInputs)];
  double value[even(kMaxInputs)];  // G u
  double scale[even(kMaxInputs)];  // of the rows
  double box[even(kMaxInputs)];
  double size[even(kMaxInputs)];  // of the inputs: 1 / sqrt(H_jj), then min(box, reach times that)
  for (int j = 0; j < n; ++j) {
    residual[j] = gradient[j] + bound_multiplier[j];
    terms[j] = std::abs(gradient[j]) + std::abs(bound_multiplier[j]);
    box[j] = std::max(std::abs(lower[j]), std::abs(upper[j]));
    size[j] = 1.0 / std::sqrt(problem.hessian.data()[j * n + j]);
  }
  for (int i = 0; i < m; ++i) value[i] = scale[i] = 0.0;
  KktResidual out{0.0, 0.0, 0.0};
  double reach = 0.0;
  for (int j = 0; j < n; ++j) {
    const double curvature = problem.hessian.data()[j * n + j];
    reach = std::max({reach, std::abs(u[j]) * curvature * size[j],  // as curved_size()
                      std::abs(gradient[j]) * size[j]});
  }
  int with[kMaxInputs];  // rows with a multiplier
  int pressing = 0;
  for (int i = 0; i < m; ++i) {
    with[pressing] = i;
    pressing += row_multiplier[i] != 0.0;
  }
  // Plain loops: the order of the sums must not depend on where the data lie.
  for (int j = 0; j < n; ++j) {
    const double power = u[j];
    const double* __restrict column = problem.hessian.data() + j * n;
    size[j] = std::min(box[j], reach * size[j]);
    for (int i = 0; i < n; ++i) {
      residual[i] += column[i] * power;
      terms[i] += std::abs(column[i]) * size[j];
    }
    const double* __restrict row = problem.rows.data() + j * m;
    for (int i = 0; i < m; ++i) {
      value[i] += row[i] * power;
      scale[i] += std::abs(row[i]) * box[j];
    }
    double force = 0.0;
    double pressure = 0.0;
    for (int k = 0; k < pressing; ++k) {
      const double term = row[with[k]] * row_multiplier[with[k]];
      force += term;
      pressure += std::abs(term);
    }
    residual[j] += force;
    terms[j] += pressure;
  }
  double energy = 0.0;
  for (int j = 0; j < n; ++j) {
    out.stationarity = worse(out.stationarity, relative(std::abs(residual[j]), terms[j]));
    energy += terms[j] * size[j];
  }
  double known = 0.0;  // largest limit that matters
  for (int i = 0; i < m; ++i) known = std::max(known, std::min(std::abs(limit[i]), scale[i]));
  for (int j = 0; j < n; ++j) {
    const double above = u[j] - upper[j];
    const double below = lower[j] - u[j];
    out.feasibility = worse(out.feasibility, relative(std::max({above, below, 0.0}), box[j]));
    const double slack = bound_multiplier[j] > 0.0 ? above : below;
    out.complementarity =
        worse(out.complementarity, relative(std::abs(slack * bound_multiplier[j]), energy));
  }
  for (int i = 0; i < m; ++i) {
    const double l = row_multiplier[i];
    if (limit[i] == kInfinity) {
      if (l != 0.0) out.complementarity = kInfinity;
      continue;
    }
    double excess = value[i] - limit[i];
    if (without_reach(scale[i], limit[i]) && excess <= kLimitRounding * known) excess = 0.0;
    const double row_scale = std::max(scale[i], std::abs(limit[i]));
    out.feasibility = worse(out.feasibility, relative(std::max(excess, 0.0), row_scale));
    // A row that is exceeded is judged by that alone.
    const double idle = l < 0.0 ? -l * row_scale : std::max(-excess, 0.0) * l;
    out.complementarity = worse(out.complementarity, relative(idle, energy));
  }
  return out;
}

}  // namespace

double inner_residual(const QpProblem& problem, const double* u) noexcept {
  const int n = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  if (m != n) return inner_residual_as(n, m, problem, u);
  return for_length<1, 2, 3, 4, 9>(
      n, [&](auto length) { return inner_residual_as(length, length, problem, u); });
}

double KktResidual::largest() const noexcept {
  return std::max({stationarity, feasibility, complementarity});
}

double curved_size(const QpProblem& problem, const double* u) noexcept {
  double size = 0.0;
  for (int j = 0; j < static_cast<int>(problem.hessian.rows()); ++j) {
    const double root = std::sqrt(problem.hessian(j, j));
    size = std::max({size, std::abs(u[j]) * root, std::abs(problem.gradient(j)) / root});
  }
  return size;
}

bool is_optimal(const KktResidual& kkt) noexcept {
  return kkt.stationarity <= kStationary && kkt.feasibility <= kFeasible &&
         kkt.complementarity <= kFeasible;
}

KktResidual evaluate_kkt(const QpProblem& problem, const QpSolution& solution) noexcept {
  const int n = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  if (m != n) return evaluate_as(n, m, problem, solution);
  return for_length<1, 2, 3, 4, 9>(
      n, [&](auto length) { return evaluate_as(length, length, problem, solution); });
}

}  // namespace photocoag
