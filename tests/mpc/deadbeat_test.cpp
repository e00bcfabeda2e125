// The plan that meets the reference at every stage: it is what `dense` finds where nothing binds,
// and its check passes nothing else.
#include "photocoag/mpc/deadbeat.hpp"
#include "photocoag/core/types.hpp"

#include <gtest/gtest.h>

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

bool taken(const Mpc& mpc) {
  const PlanData data = mpc.ocp().plan_data();
  double u[kMaxInputs];
  return mpc.ocp().deadbeat_is_optimal() && meet_reference(data, u) &&
         deadbeat_residual(data, u) <= kDeadbeatResidual;
}

TEST(Deadbeat, PowersAreThoseOfDense) {
  int all = 0;
  int short_cuts = 0;
  int active = 0;
  int relaxed = 0;
  for (const int horizon : {2, 3, 5, 10, 20, 50}) {
    for (const double peak_max : {32.0, 30.001}) {
      for (const double power_min : {0.0, 0.005}) {
        const ControlSettings settings{
            .horizon = horizon, .peak_max = peak_max, .power_min = power_min};
        Mpc mpc(model_1khz(), settings);
        ModelPredictiveController<AlwaysDense> dense(model_1khz(), settings);
        for (const OcpInstance& p : closed_loop_problems(model_1khz(), settings, 40)) {
          // The plain limit, and in every third cycle one for an eye that heats 8 % more.
          const LimitTightening hotter{.input = 1.08 * p.input,
                                       .free = InputVector::Constant(horizon - 1, 0.2),
                                       .impulse = InputVector::Zero(horizon - 1)};
          const LimitTightening* limit = p.cycle % 3 == 2 ? &hotter : nullptr;
          const MpcResult got = mpc.solve(p.state, p.input, p.cycle, p.previous_power, limit);
          const MpcResult exact = dense.solve(p.state, p.input, p.cycle, p.previous_power, limit);
          ASSERT_EQ(got.status, exact.status);
          ASSERT_EQ(got.iterations, exact.iterations);
          ASSERT_EQ(got.limit_active, exact.limit_active);
          ASSERT_EQ(got.power_reference, exact.power_reference);
          ASSERT_NEAR(got.power, exact.power, 1e-12) << horizon;
          ++all;
          active += exact.limit_active ? 1 : 0;
          relaxed += exact.status == MpcStatus::kRelaxed ? 1 : 0;
          if (!taken(mpc)) {
            // Asked the same solver the same question.
            for (int k = 0; k < horizon - 1; ++k) ASSERT_EQ(mpc.planned(k), dense.planned(k));
            continue;
          }
          ++short_cuts;
          ASSERT_EQ(exact.iterations, 0);
          for (int k = 0; k < horizon - 1; ++k) {
            ASSERT_NEAR(mpc.planned(k), dense.planned(k), 1e-12) << horizon << ", stage " << k;
          }
          // The whole check of the whole problem agrees, and its figure is no larger.
          const KktResidual kkt = evaluate_kkt(mpc.problem(), mpc.solution());
          ASSERT_TRUE(is_optimal(kkt));
          ASSERT_LE(kkt.feasibility + kkt.complementarity, 0.0);
          ASSERT_LE(kkt.stationarity, mpc.solution().kkt_residual + 1e-14);
        }
      }
    }
  }
  EXPECT_GT(short_cuts, all / 4);
  EXPECT_GT(active, 100);
  EXPECT_GT(relaxed, 20);
}

TEST(Deadbeat, OtherWeightsAskDense) {
  for (const WeightChoice& choice : weight_choices()) {
    const ControlSettings settings{.state_weight = choice.state_weight,
                                   .power_weight = choice.power_weight,
                                   .power_change_weight = choice.power_change_weight};
    const bool plain = choice.power_weight == 0.0 && choice.power_change_weight == 0.0;
    EXPECT_EQ(OptimalControlProblem(model_1khz(), settings).deadbeat_is_optimal(), plain);
  }
}

/// Three stages in which nothing binds, but only just.
struct Plan {
  double impulse[3] = {4.0, 3.0, 2.5};
  double free[3] = {20.0, 19.0, 18.0};
  double reference[3] = {22.0, 22.0, 22.0};
  double limit_impulse[3] = {5.0, 3.5, 3.0};
  double limit_free[3] = {20.5, 19.5, 18.5};
  double limit[3] = {24.0, 24.0, 24.0};
  double u[3] = {0.5, 0.375, 0.40625};  // exact

  PlanData data() const { return {3, impulse, free, reference, limit_impulse, limit_free, limit}; }
};

TEST(Deadbeat, IsForwardSubstitution) {
  const Plan plan;
  double u[3];
  ASSERT_TRUE(meet_reference(plan.data(), u));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(u[k], plan.u[k]);
  EXPECT_EQ(deadbeat_residual(plan.data(), u), 0.0);
}

TEST(Deadbeat, TheCheckPassesNothingElse) {
  const auto residual = [](auto change) {
    Plan plan;
    change(plan);
    return deadbeat_residual(plan.data(), plan.u);
  };
  for (int k = 0; k < 3; ++k) {
    for (const double small : {1e-11, -1e-11}) {
      EXPECT_GT(residual([&](Plan& p) { p.u[k] += small; }), kDeadbeatResidual);
      EXPECT_GT(residual([&](Plan& p) { p.free[k] += 100 * small; }), kDeadbeatResidual);
    }
    // A row by anything at all: the limit just below what the row reaches.
    const Plan plain;
    double reached = plain.limit_free[k];
    for (int j = 0; j <= k; ++j) reached += plain.limit_impulse[k - j] * plain.u[j];
    EXPECT_EQ(residual([&](Plan& p) { p.limit[k] = reached + 1e-12; }), 0.0);
    EXPECT_EQ(residual([&](Plan& p) { p.limit[k] = reached - 1e-12; }), kInfinity);
    for (const double bad : {kNaN, kInfinity, -kInfinity}) {
      EXPECT_EQ(residual([&](Plan& p) { p.u[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.free[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.impulse[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.reference[k] = bad; }), kInfinity);
      EXPECT_EQ(residual([&](Plan& p) { p.limit_impulse[k] = bad; }) < kInfinity, bad < 0.0);
    }
    for (const double bad : {kNaN, -kInfinity}) {
      EXPECT_EQ(residual([&](Plan& p) { p.limit[k] = bad; }), kInfinity);
    }
    EXPECT_EQ(residual([&](Plan& p) { p.limit_free[k] = kNaN; }), kInfinity);
  }
  // Met with an impulse response below 0, whose terms would not bound the KKT conditions.
  Plan cooling{.impulse = {4.0, 3.0, -0.5}, .limit = {30.0, 30.0, 30.0}};
  cooling.u[2] = 0.78125;
  EXPECT_EQ(deadbeat_residual(cooling.data(), cooling.u), kInfinity);
  // Outside of the box, though the reference is met.
  Plan plan;
  PlanData data = plan.data();
  data.upper = 0.5 - 1e-16;
  EXPECT_EQ(deadbeat_residual(data, plan.u), kInfinity);
  data.upper = 0.5;
  EXPECT_EQ(deadbeat_residual(data, plan.u), 0.0);
  data.lower = 0.375 + 1e-16;
  EXPECT_EQ(deadbeat_residual(data, plan.u), kInfinity);
}

TEST(Deadbeat, DegenerateDataAreNoPlan) {
  const auto meets = [](auto change) {
    Plan plan;
    change(plan);
    double u[3];
    return meet_reference(plan.data(), u) && deadbeat_residual(plan.data(), u) <= kDeadbeatResidual;
  };
  EXPECT_TRUE(meets([](Plan&) {}));
  for (const double first : {0.0, -4.0, 1e-320, kNaN, kInfinity}) {
    EXPECT_FALSE(meets([&](Plan& p) { p.impulse[0] = first; })) << first;
  }
  EXPECT_FALSE(meets([](Plan& p) { p.impulse[1] = -1e-3; }));  // cooling by heating
  EXPECT_FALSE(meets([](Plan& p) { p.free[2] = 40.0; }));      // needs less than no power
  EXPECT_FALSE(meets([](Plan& p) { p.free[0] = 0.0; }));       // more than all of it
  EXPECT_FALSE(meets([](Plan& p) { p.limit_free[1] = 25.0; }));
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_FALSE(meets([&](Plan& p) { p.free[1] = bad; }));
    EXPECT_FALSE(meets([&](Plan& p) { p.reference[2] = bad; }));
  }
}

TEST(Deadbeat, ATightenedLimitIsLookedAt) {
  Mpc mpc(model_1khz(), {.horizon = 5});
  Draw draw(8);
  ParametricMatrices m;
  model_1khz().evaluate(0.9, m);
  StateVector warm = StateVector::Zero(6);
  for (int k = 0; k < 200; ++k) warm = model_1khz().A_d * warm + m.input * 0.02;
  const MpcResult plain = mpc.solve(warm, m.input, 9, 0.02);
  ASSERT_EQ(plain.status, MpcStatus::kSolved);
  LimitTightening tightening{
      .input = m.input, .free = InputVector::Zero(4), .impulse = InputVector::Zero(4)};
  EXPECT_EQ(mpc.solve(warm, m.input, 9, 0.02, &tightening).power, plain.power);
  tightening.free.setConstant(4, 5.0);  // 27 K of the estimate
  const MpcResult less = mpc.solve(warm, m.input, 9, 0.02, &tightening);
  EXPECT_LT(less.power, plain.power);
  EXPECT_NEAR(model_1khz().C_peak.dot(model_1khz().A_d * warm + m.input * less.power), 27.0, 3.0);
}

TEST(Deadbeat, AllocatesNothing) {
  for (const int horizon : {2, 5, 50}) {
    Mpc mpc(model_1khz(), {.horizon = horizon});
    const auto problems = closed_loop_problems(model_1khz(), {.horizon = horizon}, 20);
    int short_cuts = 0;
    HeapUse use;
    {
      const HeapGuard guard;
      for (const OcpInstance& p : problems) {
        mpc.solve(p.state, p.input, p.cycle, p.previous_power);
        short_cuts += taken(mpc) ? 1 : 0;
      }
      use = guard.use();
    }
    EXPECT_EQ(use, HeapUse{});
    EXPECT_GT(short_cuts, 0);
  }
}

}  // namespace
}  // namespace photocoag::testing
