#include "photocoag/osqp/sparse.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/qp/kkt.hpp"

namespace photocoag {
namespace {

constexpr int kBalancedCycles = 2000;  // of the finite-horizon Gramians
constexpr double kSetUpAlpha = 1.0;    // of the problem that is solved before the treatment

StateVector input_at(const ReducedModel& model, double alpha) {
  ParametricMatrices matrices;
  model.evaluate(alpha, matrices);
  return matrices.input;
}

struct Coordinates {
  Eigen::MatrixXd to;    // z = to x
  Eigen::MatrixXd from;  // x = from z
};

// Balanced coordinates (Moore, IEEE TAC 26 (1981) 17-32; square-root form) of input -> peak over
// kBalancedCycles, each scaled to its share of the peak, K. Unique, whatever the basis of x: the
// signs of balanced coordinates cancel in the shares.
Coordinates shares_of_peak(const ReducedModel& model, double power_max) {
  const Eigen::Index n = model.order();
  const Eigen::MatrixXd A = model.A_d;
  Eigen::MatrixXd reached(kBalancedCycles, n);  // row k: (A^k B u_max)'
  Eigen::MatrixXd seen(kBalancedCycles, n);     // row k: C A^k
  Eigen::VectorXd x = Eigen::VectorXd(input_at(model, kSetUpAlpha)) * power_max;
  Eigen::RowVectorXd c = model.C_peak.transpose();
  for (int k = 0; k < kBalancedCycles; ++k) {
    reached.row(k) = x.transpose();
    seen.row(k) = c;
    x = (A * x).eval();
    c = (c * A).eval();
  }
  // x has arbitrary units: normalize before the factorizations.
  const Eigen::VectorXd size = reached.colwise().norm();
  const Eigen::VectorXd scale = (size.array() > 0.0).select(size, 1.0);
  reached *= scale.cwiseInverse().asDiagonal();
  seen *= scale.asDiagonal();
  const Eigen::MatrixXd R_reached = qr(reached).R;
  const Eigen::MatrixXd R_seen = qr(seen).R;
  const Svd<double> hankel = svd(Eigen::MatrixXd(R_seen * R_reached.transpose()));
  const double largest = hankel.values.maxCoeff();
  const Eigen::VectorXd root = hankel.values.cwiseMax(1e-14 * largest).cwiseSqrt();
  Eigen::MatrixXd to = root.cwiseInverse().asDiagonal() * hankel.U.transpose() * R_seen *
                       scale.cwiseInverse().asDiagonal();
  Eigen::MatrixXd from =
      scale.asDiagonal() * R_reached.transpose() * hankel.V * root.cwiseInverse().asDiagonal();
  const Eigen::VectorXd share = from.transpose() * Eigen::VectorXd(model.C_peak);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (std::abs(share[i]) < 1e-12 * share.cwiseAbs().maxCoeff())
      continue;  // no effect on the peak
    to.row(i) *= share[i];
    from.col(i) /= share[i];
  }
  return {std::move(to), std::move(from)};
}

}  // namespace

SparseOsqpController::SparseOsqpController(const ReducedModel& model,
                                           const ControlSettings& settings, SparseForm form)
    : form_(form), ocp_(model, settings) {
  const Eigen::MatrixXd same = Eigen::MatrixXd::Identity(model.order(), model.order());
  const Coordinates coordinates = form == SparseForm::kModelStates
                                      ? Coordinates{.to = same, .from = same}
                                      : shares_of_peak(model, settings.power_max);
  to_shares_ = coordinates.to;
  A_ = coordinates.to * Eigen::MatrixXd(model.A_d) * coordinates.from;
  output_ = coordinates.from.transpose() * Eigen::VectorXd(model.C_peak);
  share_.setZero(model.order());
  set_up();
  if (form == SparseForm::kUnprepared || form == SparseForm::kModelStates) return;
  // The cold eye at some alpha: from here on every solve has a warm start.
  const StateVector cold = StateVector::Zero(model.order());
  for (int k = 0; k < 2; ++k) solve(cold, input_at(model, kSetUpAlpha), 0, 0.0);
}

// Variables z_0 … z_{N-1}, v_0 … v_{N-2}. Constraints: z_0 given, z_k = A z_{k-1} + B v_{k-1};
// peak of z_1 … z_{N-1} below the limit; v in the box.
void SparseOsqpController::set_up() {
  const ControlSettings& s = ocp_.settings();
  const int n = static_cast<int>(A_.rows());
  const int inputs = ocp_.inputs();
  const int states = (inputs + 1) * n;
  const double r1 = s.power_weight * s.power_max * s.power_max;
  const double r2 = s.power_change_weight * s.power_max * s.power_max;
  SparseProblem qp;
  qp.P.rows = states + inputs;
  qp.A.rows = states + 2 * inputs;
  for (int k = 0; k <= inputs; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; k > 0 && i <= j; ++i) {
        state_entries_.push_back(qp.P.add(k * n + i, 2.0 * output_[i] * output_[j]));
      }
      qp.P.next_column();
      qp.A.add(k * n + j, k == 0 ? 1.0 : -1.0);
      for (int i = 0; k < inputs && i < n; ++i) qp.A.add((k + 1) * n + i, A_(i, j));
      if (k > 0) qp.A.add(states + k - 1, output_[j]);
      qp.A.next_column();
    }
  }
  for (int k = 0; k < inputs; ++k) {
    if (k > 0) qp.P.add(states + k - 1, -2.0 * r2);
    qp.P.add(states + k, 2.0 * (r1 + (k + 1 < inputs ? 2.0 * r2 : r2)));
    qp.P.next_column();
    // Any B will do: every solve sets its own.
    for (int i = 0; i < n; ++i) input_entries_.push_back(qp.A.add((k + 1) * n + i, 1.0));
    qp.A.add(states + inputs + k, 1.0);
    qp.A.next_column();
  }
  weights_.setOnes(inputs);
  qp.q.assign(states + inputs, 0.0);
  qp.lower.assign(qp.A.rows, 0.0);
  qp.upper.assign(qp.A.rows, 0.0);
  for (int k = 0; k < inputs; ++k) {
    qp.lower[states + k] = -kOsqpInfinity;
    qp.upper[states + k] = s.peak_max;
    qp.lower[states + inputs + k] = s.power_min / s.power_max;
    qp.upper[states + inputs + k] = 1.0;
  }
  workspace_.set_up(std::move(qp), s.osqp_tolerance);
}

MpcResult SparseOsqpController::solve(const StateVector& state, const StateVector& input,
                                      long long cycle, double previous_power) noexcept {
  MpcResult result;
  result.power_reference = ocp_.steady_power(input, cycle);
  const double previous = cycle == 0 ? result.power_reference : previous_power;
  ocp_.condense({.state = state,
                 .input = input,
                 .cycle = cycle,
                 .power_reference = result.power_reference,
                 .previous_power = previous},
                problem_);
  fill(state, input, cycle, result.power_reference, previous);
  QpStatus status = examine(problem_);
  if (status == QpStatus::kSolved) {
    if (form_ == SparseForm::kPrepared) {
      status = workspace_.solve_checked(new_weights_, true, [this] { return read(); });
    } else {
      status = workspace_.solve(new_weights_, true);
      if (status == QpStatus::kSolved) read();  // OSQP's powers, whatever the check says
    }
    result.iterations = workspace_.iterations();
  }
  result.solver_status = status;
  if (status == QpStatus::kKktFailed) result.status = MpcStatus::kKktFailed;
  if (status != QpStatus::kSolved) return result;
  result.status = ocp_.limit_relaxed() ? MpcStatus::kRelaxed : MpcStatus::kSolved;
  result.kkt_residual = solution_.kkt_residual;
  result.limit_active = (solution_.row_multiplier.array() > 0.0).any();
  result.power = solution_.power[0] * ocp_.power_max();
  return result;
}

void SparseOsqpController::fill(const StateVector& state, const StateVector& input, long long cycle,
                                double reference, double previous) noexcept {
  const ControlSettings& s = ocp_.settings();
  const int n = static_cast<int>(A_.rows());
  const int inputs = ocp_.inputs();
  const int states = (inputs + 1) * n;
  SparseProblem& qp = workspace_.problem();
  share_.noalias() = to_shares_ * state;
  for (int i = 0; i < n; ++i) qp.lower[i] = qp.upper[i] = share_[i];
  share_.noalias() = to_shares_ * input;
  for (std::size_t e = 0; e < input_entries_.size(); ++e) {
    qp.A.value[input_entries_[e]] = share_[static_cast<Eigen::Index>(e) % n] * s.power_max;
  }
  new_weights_ = false;
  std::size_t entry = 0;
  for (int k = 0; k < inputs; ++k) {
    const double weight = state_weight(s.state_weight, cycle + k + 1);
    const double target = ocp_.reference_at(cycle + k + 1);
    new_weights_ = new_weights_ || weight != weights_[k];
    weights_[k] = weight;
    for (int j = 0; j < n; ++j) {
      qp.q[(k + 1) * n + j] = -2.0 * weight * target * output_[j];
      for (int i = 0; i <= j; ++i) {
        qp.P.value[state_entries_[entry++]] = 2.0 * weight * output_[i] * output_[j];
      }
    }
    qp.upper[states + k] = ocp_.peak_limit(k + 1);
    qp.q[states + k] = -2.0 * s.power_weight * s.power_max * reference;
  }
  qp.q[states] -= 2.0 * s.power_change_weight * s.power_max * previous;
}

// OSQP's powers and multipliers, which are those of the condensed problem too. True: they passed.
bool SparseOsqpController::read() noexcept {
  const int inputs = ocp_.inputs();
  const int states = (inputs + 1) * static_cast<int>(A_.rows());
  const double* power = workspace_.x() + states;
  const double* row = workspace_.y() + states;
  const double* bound = row + inputs;
  solution_.power.resize(inputs);
  solution_.bound_multiplier.resize(inputs);
  solution_.row_multiplier.resize(inputs);
  for (int k = 0; k < inputs; ++k) {
    solution_.power[k] = std::clamp(power[k], problem_.lower[k], problem_.upper[k]);
    solution_.bound_multiplier[k] = bound[k];
    solution_.row_multiplier[k] = std::max(row[k], 0.0);
  }
  if (form_ == SparseForm::kPrepared) return polisher_.polish(problem_, solution_);
  const KktResidual kkt = evaluate_kkt(problem_, solution_);
  solution_.kkt_residual = kkt.largest();
  return is_optimal(kkt);
}

CondensedOsqpController::CondensedOsqpController(const ReducedModel& model,
                                                 const ControlSettings& settings)
    : ModelPredictiveController<CondensedOsqp>(model, settings,
                                               CondensedOsqp(settings.osqp_tolerance)) {
  solver().prepare(ocp().inputs(), ocp().inputs(), RowPattern::kLowerTriangular);
  const StateVector cold = StateVector::Zero(model.order());
  for (int k = 0; k < 2; ++k) solve(cold, input_at(model, kSetUpAlpha), 0, 0.0);
}

}  // namespace photocoag
