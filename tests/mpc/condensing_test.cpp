// The condensed quadratic program against the paper's cost and constraints, by simulation.
#include <gtest/gtest.h>

#include <cmath>

#include "mpc/paper_cost.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag::testing {
namespace {

Instance random_instance(Draw& draw, const ReducedModel& model, const ControlSettings& settings) {
  Instance ocp{.model = model,
               .settings = settings,
               .state = reachable_state(model, draw, draw.integer(0, 40), 0.06),
               .input = input_at(model, draw.between(0.2, 2.0)),
               .cycle = draw.integer(0, 5),
               .power_reference = draw.between(0.01, 0.05),
               .previous_power = draw.between(0.0, 0.1)};
  return ocp;
}

/// The program's objective at powers in W.
Real objective(const QpProblem& qp, const std::vector<Real>& power, double power_max) {
  Real sum = 0;
  for (Eigen::Index i = 0; i < qp.gradient.size(); ++i) {
    const Real v = power[i] / power_max;
    sum += qp.gradient[i] * v;
    for (Eigen::Index j = 0; j < qp.gradient.size(); ++j) {
      sum += qp.hessian(i, j) * v * (power[j] / power_max) / 2;
    }
  }
  return sum;
}

std::vector<Real> random_powers(Draw& draw, int count) {
  std::vector<Real> power;
  for (int k = 0; k < count; ++k) power.push_back(draw.between(0.0, 0.1));
  return power;
}

TEST(Condensing, CostDifferencesAreThoseOfTheSimulatedModel) {
  Draw draw(1);
  for (const int horizon : {2, 3, 4, 5, 10, 23, 50}) {
    for (const double r1 : {0.0, 5e1, 5e4}) {
      for (const double r2 : {0.0, 5e1, 5e4}) {
        for (const StateWeight kind : {StateWeight::kConstant, StateWeight::kDelayed}) {
          if (kind == StateWeight::kDelayed && r1 + r2 == 0.0) continue;  // refused, see below
          const ControlSettings settings{.horizon = horizon,
                                         .state_weight = kind,
                                         .power_weight = r1,
                                         .power_change_weight = r2};
          for (int cycle = 0; cycle <= 5; ++cycle) {
            Instance ocp = random_instance(draw, model_1khz(), settings);
            ocp.cycle = cycle;
            OptimalControlProblem problem(ocp.model, settings);
            QpProblem qp;
            problem.condense(ocp.data(), qp);
            ASSERT_EQ(qp.gradient.size(), horizon - 1);
            const auto one = random_powers(draw, horizon - 1);
            const auto two = random_powers(draw, horizon - 1);
            const Real expected = paper_cost(ocp, one) - paper_cost(ocp, two);
            const Real found = objective(qp, one, 0.1) - objective(qp, two, 0.1);
            // The program's entries are doubles, rounded at the size of the cost itself.
            const Real scale =
                paper_cost(ocp, one) + paper_cost(ocp, two) + std::abs(objective(qp, one, 0.1));
            ASSERT_NEAR(static_cast<double>((found - expected) / scale), 0.0, 1e-13)
                << "N " << horizon << ", R1 " << r1 << ", R2 " << r2 << ", n " << cycle;
            ASSERT_TRUE(qp.hessian == qp.hessian.transpose());
          }
        }
      }
    }
  }
}

TEST(Condensing, DelayedWeightWaivesOutputsOneToThreeOnly) {
  // At n = 3 all scored outputs are later than 3; at n = 2 the first one is not scored.
  Draw draw(5);
  ControlSettings settings{
      .horizon = 4, .state_weight = StateWeight::kDelayed, .power_weight = 5e1};
  Instance ocp = random_instance(draw, model_1khz(), settings);
  const auto hessian_at = [&](long long cycle, StateWeight kind) {
    ControlSettings s = settings;
    s.state_weight = kind;
    ocp.cycle = cycle;
    OptimalControlProblem problem(model_1khz(), s);
    QpProblem qp;
    problem.condense(ocp.data(), qp);
    return InputMatrix(qp.hessian);
  };
  EXPECT_TRUE(hessian_at(3, StateWeight::kDelayed) == hessian_at(3, StateWeight::kConstant));
  EXPECT_FALSE(hessian_at(2, StateWeight::kDelayed) == hessian_at(2, StateWeight::kConstant));
  // n = 0, N = 4: outputs 1, 2, 3 are all waived, only R1 is left: 2 R1 u_max^2 on the diagonal.
  const InputMatrix only_r1 = hessian_at(0, StateWeight::kDelayed);
  EXPECT_TRUE(only_r1.isApprox(InputMatrix(InputMatrix::Identity(3, 3)), 1e-14)) << only_r1;
}

TEST(Condensing, LimitRowsAreSimulatedPeaks) {
  Draw draw(2);
  for (const double power_min : {0.0, 0.004}) {
    for (const int horizon : {2, 5, 20, 50}) {
      const ControlSettings settings{.horizon = horizon, .power_min = power_min};
      OptimalControlProblem problem(model_1khz(), settings);
      for (int repeat = 0; repeat < 50; ++repeat) {
        Instance ocp = random_instance(draw, model_1khz(), settings);
        ocp.state *= draw.between(0.0, 2.0);  // also above the limit
        QpProblem qp;
        problem.condense(ocp.data(), qp);
        const auto power = random_powers(draw, horizon - 1);
        const auto peaks = simulated_peaks(ocp, power);
        const auto least = simulated_peaks(
            ocp, std::vector<Real>(static_cast<std::size_t>(horizon) - 1, power_min));
        bool relaxed = false;
        for (int k = 0; k < horizon - 1; ++k) {
          Real sum = 0;
          for (int j = 0; j < horizon - 1; ++j) sum += qp.rows(k, j) * power[j] / Real(0.1);
          const Real allowed = std::max<Real>(settings.peak_max, least[k]);
          // Slack of the row = allowed peak - simulated peak; rounding of sums of up to 50 terms of
          // 30 K.
          ASSERT_NEAR(static_cast<double>(qp.limit[k] - sum),
                      static_cast<double>(allowed - peaks[k]), 1e-11);
          ASSERT_NEAR(problem.free_response(k + 1), static_cast<double>(least[k]), 1e-11);
          relaxed = relaxed || problem.free_response(k + 1) > settings.peak_max;
        }
        ASSERT_EQ(problem.limit_relaxed(), relaxed);
        ASSERT_TRUE((qp.lower.array() == power_min / 0.1).all());
        ASSERT_TRUE((qp.upper.array() == 1.0).all());
      }
    }
  }
}

TEST(Condensing, ReferencePowerHoldsTheReferenceForEver) {
  for (const ReducedModel* model : {&model_1khz(), &model_250hz()}) {
    for (const double alpha : {0.3, 0.7363, 1.1, 1.7}) {
      const OptimalControlProblem problem(*model, {.period = model->period});
      const StateVector input = input_at(*model, alpha);
      const double power = problem.steady_power(input);
      // 1e5 periods are 100 s; the slowest mode decays in less than 1 s.
      StateVector state = StateVector::Zero(model->order());
      for (int k = 0; k < 100000; ++k) state = (model->A_d * state + input * power).eval();
      EXPECT_NEAR(model->C_peak.dot(state), 30.0, 30.0 * 1e-11) << "alpha " << alpha;
      // Per watt it is the model's own steady gain of domain.md, 1.0 to 1.5 K/mW: tens of
      // milliwatts.
      EXPECT_GT(power, 0.015);
      EXPECT_LT(power, 0.045);
    }
  }
}

TEST(Condensing, ThereIsNoBoundAtStageZero) {
  // Just above the limit now, below it a period later without light: nothing to relax.
  const ControlSettings settings{.horizon = 5};
  OptimalControlProblem problem(model_1khz(), settings);
  Draw draw(9);
  StateVector state = StateVector::Zero(6);
  const StateVector input = input_at(model_1khz(), 1.0);
  for (int k = 0; k < 20; ++k) state = (model_1khz().A_d * state + input * 0.05).eval();
  const double peak = model_1khz().C_peak.dot(state);
  state *= 32.05 / peak;
  const Instance ocp{.model = model_1khz(), .settings = settings, .state = state, .input = input};
  ASSERT_LT(simulated_peaks(ocp, {0.0L})[0], 32.0L);
  QpProblem qp;
  problem.condense(ocp.data(), qp);
  EXPECT_FALSE(problem.limit_relaxed());
  EXPECT_EQ(qp.rows.rows(), 4);
  EXPECT_TRUE((qp.limit.array() > 0.0).all()) << "u = 0 satisfies every row";
}

TEST(Condensing, RefusesAnotherPeriodAndAProblemWithoutUniqueAnswer) {
  try {
    OptimalControlProblem problem(model_1khz(), {.period = 4e-3});
    FAIL() << "accepted a model for another period";
  } catch (const Error& error) {
    EXPECT_EQ(error.parts().key, "control.period_ms");
    EXPECT_NE(error.parts().found.find("4 ms"), std::string::npos) << error.what();
    EXPECT_NE(error.parts().found.find("1 ms"), std::string::npos) << error.what();
  }
  EXPECT_THROW(OptimalControlProblem(model_1khz(), {.state_weight = StateWeight::kDelayed}), Error);
  EXPECT_THROW(OptimalControlProblem(model_1khz(), {.horizon = 1}), Error);
  EXPECT_THROW(OptimalControlProblem(model_1khz(), {.horizon = 51}), Error);
}

}  // namespace
}  // namespace photocoag::testing
