#include "photocoag/qp/single.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/qp/kkt.hpp"
#include "photocoag/qp/tolerances.hpp"

namespace photocoag {
namespace {

// One input and one row, as for N = 2: the unconstrained minimizer, if feasible. Same arithmetic as
// HessianFactor.
bool take_single(const QpProblem& problem, QpSolution& solution) noexcept {
  const double curvature = *problem.hessian.data();
  const double u = -*problem.gradient.data() * (1.0 / curvature);
  const double residual = inner_residual_single(problem, u);
  if (!(curvature > 0.0 && residual <= kSharp)) return false;
  solution.power.resize(1);
  solution.bound_multiplier.resize(1);
  solution.row_multiplier.resize(1);
  *solution.power.data() = u;
  *solution.bound_multiplier.data() = 0.0;
  *solution.row_multiplier.data() = 0.0;
  solution.kkt_residual = residual;
  solution.iterations = 0;
  solution.status = QpStatus::kSolved;
  return true;
}

// The same if infeasible: the nearest feasible point, if its KKT residual passes; one active-set
// change. False if it does not.
bool clip_single(const QpProblem& problem, QpSolution& solution) noexcept {
  const double curvature = *problem.hessian.data();
  const double gradient = *problem.gradient.data();
  const double row = *problem.rows.data();
  const double limit = *problem.limit.data();
  const double lower = *problem.lower.data();
  const double upper = *problem.upper.data();
  const double wish = -gradient * (1.0 / curvature);
  if (!(curvature > 0.0 && std::abs(wish) < kInfinity && lower > -kInfinity && upper < kInfinity &&
        std::abs(row) < kInfinity && limit > -kInfinity)) {
    return false;
  }
  const double most = row > 0.0 ? std::min(upper, limit / row) : upper;
  const double least = row < 0.0 ? std::max(lower, limit / row) : lower;
  if (!(least <= most && (wish > most || wish < least))) return false;
  const double u = wish > most ? most : least;
  const bool by_row = wish > most ? most < upper : least > lower;
  const double force = -(curvature * u + gradient);
  solution.power.setConstant(1, u);
  solution.bound_multiplier.setConstant(1, by_row ? 0.0 : force);
  solution.row_multiplier.setConstant(1, by_row ? force / row : 0.0);
  const KktResidual kkt = evaluate_kkt(problem, solution);
  solution.kkt_residual = kkt.largest();
  solution.iterations = 1;
  solution.status = QpStatus::kSolved;
  return is_optimal(kkt) && solution.kkt_residual <= kSharp;
}

}  // namespace

bool solve_single(const QpProblem& problem, bool may_bind, QpSolution& solution) noexcept {
  return take_single(problem, solution) || (may_bind && clip_single(problem, solution));
}

}  // namespace photocoag
