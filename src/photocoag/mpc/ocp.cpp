#include "photocoag/mpc/ocp.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/fixed_length.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

double state_weight(StateWeight kind, long long stage) noexcept {
  return kind == StateWeight::kDelayed && stage >= 1 && stage <= 3 ? 0.0 : 1.0;
}

OptimalControlProblem::OptimalControlProblem(const ReducedModel& model,
                                             const ControlSettings& settings)
    : settings_(settings) {
  settings.validate();
  if (std::abs(model.period - settings.period) > 1e-9 * settings.period) {
    throw Error(ErrorParts{
        .key = "control.period_ms",
        .problem = "the reduced model is for another period",
        .found =
            fmt::format("{:g} ms, model for {:g} ms", settings.period * 1e3, model.period * 1e3),
        .accepted = "the model's period, or a model made for this one with `photocoag reduce`"});
  }
  const Eigen::Index n = model.order();
  peak_powers_.resize(settings.horizon, n);
  peak_powers_.row(0) = model.C_peak.transpose();
  for (int k = 1; k < settings.horizon; ++k) {
    peak_powers_.row(k) = (peak_powers_.row(k - 1) * model.A_d).eval();
  }
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(n, n) - Eigen::MatrixXd(model.A_d);
  steady_row_ = solve_transposed(rest, Eigen::VectorXd(model.C_peak));
  free_.setZero(inputs());
  impulse_.setZero(inputs());
  least_.setZero(inputs());
  limit_.setZero(inputs());
  limit_impulse_.setZero(inputs());
  limit_free_.setZero(inputs());
  reference_.setZero(inputs());
}

double OptimalControlProblem::steady_power(const StateVector& input,
                                           long long cycle) const noexcept {
  return reference_at(cycle) / steady_row_.dot(input);
}

double OptimalControlProblem::reference_at(long long cycle) const noexcept {
  return settings_.share_at(cycle) *
         settings_.reference_at(static_cast<double>(cycle) * settings_.period);
}

void OptimalControlProblem::respond(const OcpData& data) noexcept {
  for_length<1, 4, 9>(inputs(), [&](auto length) {
    const int n = length;
    const double least_power = settings_.power_min / settings_.power_max;
    const double scale = settings_.power_max;
    tightened_ = data.tightening != nullptr;
    // Column by column of peak_powers_: each sum runs over the states in order.
    const auto times_powers = [this, n](int first, const StateVector& x, double* __restrict out) {
      double sum[even(kMaxInputs)];
      PHOTOCOAG_UNROLLED
      for (int i = 0; i < n; ++i) sum[i] = 0.0;
      const double* __restrict column = peak_powers_.data() + first;
      const double* __restrict values = x.data();
      const int states = static_cast<int>(x.size());
      for (int s = 0; s < states; ++s, column += n + 1) {
        const double value = values[s];
        PHOTOCOAG_UNROLLED
        for (int i = 0; i < n; ++i) sum[i] += column[i] * value;
      }
      PHOTOCOAG_UNROLLED
      for (int i = 0; i < n; ++i) out[i] = sum[i];
    };
    double* impulse = impulse_.data();
    double* free = free_.data();
    double* limit_impulse = limit_impulse_.data();
    double* limit_free = limit_free_.data();
    times_powers(0, data.input, impulse);
    times_powers(1, data.state, free);
    for (int i = 0; i < n; ++i) {
      impulse[i] *= scale;
      limit_impulse[i] = impulse[i];
      limit_free[i] = free[i];
    }
    if (tightened_) {
      times_powers(0, data.tightening->input, limit_impulse);
      for (int i = 0; i < n; ++i) {
        limit_impulse[i] = limit_impulse[i] * scale + data.tightening->impulse[i];
        limit_free[i] = free[i] + data.tightening->free[i];
      }
    }
    const bool constant = settings_.shares.empty();
    const bool held = constant && settings_.reference_times.empty();
    double least_sum = 0.0;
    limit_relaxed_ = false;
    for (int k = 0; k < n; ++k) {
      least_sum += limit_impulse[k];
      const double least = limit_free[k] + least_sum * least_power;
      const double limit = constant ? settings_.peak_max
                                    : settings_.share_at(data.cycle + k + 1) * settings_.peak_max;
      reference_.data()[k] = held ? settings_.peak_reference : reference_at(data.cycle + k + 1);
      const bool relaxed = least > limit;
      limit_relaxed_ = limit_relaxed_ || relaxed;
      // Relaxed: what the smallest powers reach. Then they satisfy every row, and since heating
      // never cools, no power above them is left in the stages before.
      least_.data()[k] = least;
      limit_.data()[k] = relaxed ? least : limit;
    }
  });
}

void OptimalControlProblem::condense(const OcpData& data, QpProblem& problem) noexcept {
  respond(data);
  assemble(data.cycle, data.power_reference, data.previous_power, problem);
}

void OptimalControlProblem::assemble(long long cycle, double power_reference, double previous_power,
                                     QpProblem& problem) const noexcept {
  const int n = inputs();
  const double scale = settings_.power_max;
  problem.resize(n, n);
  problem.lower.setConstant(settings_.power_min / scale);
  problem.upper.setConstant(1.0);

  for (int k = 0; k < n; ++k) {
    problem.limit[k] = limit_[k] - limit_free_[k];
    for (int j = 0; j < n; ++j) problem.rows(k, j) = j <= k ? limit_impulse_[k - j] : 0.0;
  }

  // Output k + 1 depends on inputs 0 … k through the same Toeplitz rows G: H = 2 G'R0 G + …, where
  // H(j-d, j) / 2 = sum over l < n - j of R0 h_l h_{l+d}: while R0 is 1, each is the one below it
  // on its diagonal and one term more.
  double weight[even(kMaxInputs)];
  bool all_one = true;
  for (int k = 0; k < n; ++k) {
    weight[k] = state_weight(settings_.state_weight, cycle + k + 1);
    all_one = all_one && weight[k] == 1.0;
  }
  for (int d = 0; d < n; ++d) {
    double sum = 0.0;
    for (int j = n - 1; j >= d; --j) {
      if (all_one) {
        sum += impulse_[n - 1 - j] * impulse_[n - 1 - j + d];
      } else {
        sum = 0.0;
        for (int l = 0; l < n - j; ++l) sum += weight[l + j] * impulse_[l] * impulse_[l + d];
      }
      problem.hessian(j - d, j) = problem.hessian(j, j - d) = 2.0 * sum;
    }
  }
  const double r1 = settings_.power_weight * scale * scale;
  const double r2 = settings_.power_change_weight * scale * scale;
  for (int j = 0; j < n; ++j) {
    double gradient = 0.0;
    for (int k = j; k < n; ++k) {
      gradient += weight[k] * impulse_[k - j] * (free_[k] - reference_[k]);
    }
    problem.gradient[j] = 2.0 * (gradient - r1 * power_reference / scale);
    problem.hessian(j, j) += 2.0 * (r1 + (j + 1 < n ? 2.0 * r2 : r2));
    if (j > 0) {
      problem.hessian(j - 1, j) -= 2.0 * r2;
      problem.hessian(j, j - 1) -= 2.0 * r2;
    }
  }
  problem.gradient[0] -= 2.0 * r2 * previous_power / scale;
}

}  // namespace photocoag
