// The plan with penalties where nothing binds: it is what `dense` finds there, and its check passes
// nothing else.
#include "photocoag/core/types.hpp"
#include "photocoag/mpc/penalized_plan.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "mpc/always_dense.hpp"
#include "photocoag/benchmark/problem_set.hpp"
#include "photocoag/qp/kkt.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

using Mpc = ModelPredictiveController<DenseSolver>;

PlanPenalties penalties_of(const Mpc& mpc, const MpcResult& result, double previous) {
  return mpc.ocp().plan_penalties(result.power_reference, previous);
}

TEST(PenalizedPlan, PowersAreThoseOfDense) {
  std::vector<WeightChoice> choices = weight_choices();
  choices.push_back({"both", StateWeight::kConstant, 2e3, 5e4});
  choices.push_back({"strong", StateWeight::kConstant, 1e7, 1e8});
  choices.push_back({"weak", StateWeight::kDelayed, 1e-4, 1e-4});
  for (const WeightChoice& choice : choices) {
    int all = 0;
    int short_cuts = 0;
    int active = 0;
    for (const int horizon : {2, 3, 5, 10, 20, 50}) {
      for (const double peak_max : {32.0, 30.001}) {
        const ControlSettings settings{.horizon = horizon,
                                       .peak_max = peak_max,
                                       .state_weight = choice.state_weight,
                                       .power_weight = choice.power_weight,
                                       .power_change_weight = choice.power_change_weight};
        Mpc mpc(model_1khz(), settings);
        ModelPredictiveController<AlwaysDense> dense(model_1khz(), settings);
        for (const OcpInstance& p : closed_loop_problems(model_1khz(), settings, 40)) {
          const LimitTightening hotter{.input = 1.08 * p.input,
                                       .free = InputVector::Constant(horizon - 1, 0.2),
                                       .impulse = InputVector::Zero(horizon - 1)};
          const LimitTightening* limit = p.cycle % 3 == 2 ? &hotter : nullptr;
          const MpcResult got = mpc.solve(p.state, p.input, p.cycle, p.previous_power, limit);
          const MpcResult exact = dense.solve(p.state, p.input, p.cycle, p.previous_power, limit);
          ASSERT_EQ(got.status, exact.status);
          ASSERT_EQ(got.iterations, exact.iterations);
          ASSERT_EQ(got.limit_active, exact.limit_active);
          ASSERT_NEAR(got.power, exact.power, 1e-12) << choice.name << ", N = " << horizon;
          for (int k = 0; k < horizon - 1; ++k) {
            ASSERT_NEAR(mpc.planned(k), dense.planned(k), 1e-12) << choice.name << ", " << horizon;
          }
          ++all;
          active += exact.limit_active ? 1 : 0;
          // Taken exactly where it may be and its check agrees.
          double u[kMaxInputs];
          const PlanData data = mpc.ocp().plan_data();
          const PlanPenalties penalties =
              penalties_of(mpc, got, p.cycle == 0 ? got.power_reference : p.previous_power);
          const bool taken = mpc.ocp().penalized_is_optimal(p.cycle) &&
                             minimize_penalized(data, penalties, u) &&
                             penalized_residual(data, penalties, u) <= kDeadbeatResidual;
          if (!taken) continue;
          ++short_cuts;
          ASSERT_EQ(u[0] * settings.power_max, got.power);
          ASSERT_EQ(exact.iterations, 0);
          const KktResidual kkt = evaluate_kkt(mpc.problem(), mpc.solution());
          ASSERT_TRUE(is_optimal(kkt));
          ASSERT_LE(kkt.feasibility + kkt.complementarity, 0.0);
          ASSERT_LE(kkt.stationarity, mpc.solution().kkt_residual + 1e-14);
        }
      }
    }
    const bool plain = choice.power_weight + choice.power_change_weight == 0.0;
    EXPECT_EQ(short_cuts > all / 4, !plain) << choice.name;
    EXPECT_EQ(short_cuts > 0, !plain) << choice.name;
  }
}

TEST(PenalizedPlan, TheDelayedWeightAsksDenseInTheFirstThreeCycles) {
  for (const StateWeight weight : {StateWeight::kConstant, StateWeight::kDelayed}) {
    const OptimalControlProblem ocp(model_1khz(),
                                    {.horizon = 5, .state_weight = weight, .power_weight = 50.0});
    for (long long cycle = 0; cycle < 6; ++cycle) {
      bool all_one = true;
      for (int k = 0; k < ocp.inputs(); ++k) {
        all_one = all_one && state_weight(weight, cycle + k + 1) == 1.0;
      }
      EXPECT_EQ(ocp.penalized_is_optimal(cycle), all_one) << cycle;
    }
  }
  EXPECT_FALSE(OptimalControlProblem(model_1khz(), {.horizon = 5}).penalized_is_optimal(9));
}

/// Three stages in which nothing binds.
struct Plan {
  double impulse[3] = {4.0, 3.0, 2.5};
  double free[3] = {20.0, 19.0, 18.0};
  double reference[3] = {22.0, 22.0, 22.0};
  double limit_impulse[3] = {5.0, 3.5, 3.0};
  double limit_free[3] = {20.5, 19.5, 18.5};
  double limit[3] = {24.0, 24.0, 24.0};
  PlanPenalties penalties{.power = 2.0, .change = 3.0, .power_reference = 0.4, .previous = 0.6};
  double u[3] = {};

  PlanData data() const { return {3, impulse, free, reference, limit_impulse, limit_free, limit}; }
  bool minimize() { return minimize_penalized(data(), penalties, u); }
  double residual() const { return penalized_residual(data(), penalties, u); }
  double cost(const double* v) const {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
      double peak = free[k] - reference[k];
      for (int j = 0; j <= k; ++j) peak += impulse[k - j] * v[j];
      const double change = v[k] - (k > 0 ? v[k - 1] : penalties.previous);
      const double power = v[k] - penalties.power_reference;
      sum += peak * peak + penalties.power * power * power + penalties.change * change * change;
    }
    return sum;
  }
};

TEST(PenalizedPlan, IsTheLeastCost) {
  for (const double power : {0.0, 1e-3, 2.0, 1e4}) {
    for (const double change : {0.0, 1e-3, 3.0, 1e4}) {
      if (power + change == 0.0) continue;
      Plan plan;
      plan.penalties.power = power;
      plan.penalties.change = change;
      for (double& limit : plan.limit) limit = 40.0;
      ASSERT_TRUE(plan.minimize());
      // Rounding of R2 times the powers, over terms that are small where the powers change little.
      EXPECT_LE(plan.residual(), kDeadbeatResidual);
      const double least = plan.cost(plan.u);
      for (int k = 0; k < 3; ++k) {
        for (const double step : {1e-4, -1e-4}) {
          std::array<double, 3> moved{plan.u[0], plan.u[1], plan.u[2]};
          moved[static_cast<std::size_t>(k)] += step;
          EXPECT_GT(plan.cost(moved.data()), least);
        }
      }
    }
  }
}

TEST(PenalizedPlan, TheCheckPassesNothingElse) {
  const auto residual = [](auto change) {
    Plan plan;
    EXPECT_TRUE(plan.minimize());
    change(plan);
    return plan.residual();
  };
  EXPECT_LE(residual([](Plan&) {}), 1e-15);
  for (int k = 0; k < 3; ++k) {
    for (const double small : {1e-11, -1e-11}) {
      EXPECT_GT(residual([&](Plan& p) { p.u[k] += small; }), kDeadbeatResidual);
      EXPECT_GT(residual([&](Plan& p) { p.free[k] += 100 * small; }), kDeadbeatResidual);
    }
    Plan plain;
    ASSERT_TRUE(plain.minimize());
    double reached = plain.limit_free[k];
    for (int j = 0; j <= k; ++j) reached += plain.limit_impulse[k - j] * plain.u[j];
    EXPECT_LT(residual([&](Plan& p) { p.limit[k] = reached + 1e-12; }), 1e-15);
    EXPECT_EQ(residual([&](Plan& p) { p.limit[k] = reached - 1e-12; }), kInfinity);
    for (const double bad : {kNaN, kInfinity, -kInfinity}) {
      EXPECT_EQ(residual([&](Plan& p) { p.u[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.free[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.impulse[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.reference[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.limit_impulse[k] = bad; }), kInfinity);
    }
    for (const double bad : {kNaN, -kInfinity}) {
      EXPECT_EQ(residual([&](Plan& p) { p.limit[k] = bad; }), kInfinity);
    }
  }
  for (const double bad : {1.0 + 1e-10, 1.0 - 1e-10}) {
    EXPECT_GT(residual([&](Plan& p) { p.penalties.power *= bad; }), kDeadbeatResidual);
    EXPECT_GT(residual([&](Plan& p) { p.penalties.change *= bad; }), kDeadbeatResidual);
    EXPECT_GT(residual([&](Plan& p) { p.penalties.power_reference *= bad; }), kDeadbeatResidual);
    EXPECT_GT(residual([&](Plan& p) { p.penalties.previous *= bad; }), kDeadbeatResidual);
  }
  for (const double bad : {kNaN, kInfinity}) {
    EXPECT_EQ(residual([&](Plan& p) { p.penalties.power = bad; }), kInfinity);
    EXPECT_EQ(residual([&](Plan& p) { p.penalties.previous = bad; }), kInfinity);
  }
  Plan plan;
  ASSERT_TRUE(plan.minimize());
  PlanData data = plan.data();
  data.upper = plan.u[0] - 1e-16;
  EXPECT_EQ(penalized_residual(data, plan.penalties, plan.u), kInfinity);
  EXPECT_FALSE(minimize_penalized(data, plan.penalties, plan.u));
}

TEST(PenalizedPlan, DegenerateDataAreNoPlan) {
  const auto minimizes = [](auto change) {
    Plan plan;
    change(plan);
    return plan.minimize() && plan.residual() <= kDeadbeatResidual;
  };
  EXPECT_TRUE(minimizes([](Plan&) {}));
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_FALSE(minimizes([&](Plan& p) { p.impulse[k] = bad; }));
      EXPECT_FALSE(minimizes([&](Plan& p) { p.free[k] = bad; }));
      EXPECT_FALSE(minimizes([&](Plan& p) { p.reference[k] = bad; }));
    }
    EXPECT_FALSE(minimizes([&](Plan& p) { p.penalties.power_reference = bad; }));
    EXPECT_FALSE(minimizes([&](Plan& p) { p.penalties.power = bad; }));
  }
  EXPECT_FALSE(minimizes([](Plan& p) { p.impulse[0] = 0.0; }));
  EXPECT_FALSE(minimizes([](Plan& p) { p.free[0] = 60.0; }));  // needs less than no power
  EXPECT_FALSE(minimizes([](Plan& p) { p.limit_free[1] = 25.0; }));
}

TEST(PenalizedPlan, AllocatesNothing) {
  for (const int horizon : {2, 5, 50}) {
    const ControlSettings settings{
        .horizon = horizon, .power_weight = 5e4, .power_change_weight = 50.0};
    Mpc mpc(model_1khz(), settings);
    const auto problems = closed_loop_problems(model_1khz(), settings, 20);
    HeapUse use;
    {
      const HeapGuard guard;
      for (const OcpInstance& p : problems) {
        mpc.solve(p.state, p.input, p.cycle, p.previous_power);
      }
      use = guard.use();
    }
    EXPECT_EQ(use, HeapUse{});
  }
}

}  // namespace
}  // namespace photocoag::testing
