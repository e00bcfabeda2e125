// The paper's solver behind the same seam as ours: right or no answer at any tolerance, no heap in
// the cycle, independent of the reduced model's basis.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mpc/paper_cost.hpp"
#include "photocoag/osqp/sparse.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

using Exact = ModelPredictiveController<DenseSolver>;
static_assert(PredictiveController<SparseOsqpController>);
static_assert(PredictiveController<CondensedOsqpController>);

template <typename Controller>
class OsqpControllers : public ::testing::Test {};
using Both = ::testing::Types<SparseOsqpController, CondensedOsqpController>;
TYPED_TEST_SUITE(OsqpControllers, Both);

std::vector<ControlSettings> cases(int horizon, double tolerance) {
  ControlSettings plain{.horizon = horizon, .osqp_tolerance = tolerance};
  std::vector<ControlSettings> all(4, plain);
  all[1].power_weight = 5e4;
  all[2].power_change_weight = 5e4;
  all[3].state_weight = StateWeight::kDelayed;
  all[3].power_weight = 5e1;
  return all;
}

// A closed loop on the reduced model with a wrong estimate in every cycle; visits both results.
template <typename Controller, typename Visit>
void compare(const ControlSettings& settings, std::uint64_t seed, double disturbance,
             Visit&& visit) {
  Draw draw(seed);
  Controller osqp(model_1khz(), settings);
  Exact exact(model_1khz(), settings);
  const StateVector input = input_at(model_1khz(), draw.between(0.35, 1.5));
  StateVector state = StateVector::Zero(6);
  double power = 0.0;
  for (int cycle = 0; cycle < 60; ++cycle) {
    const StateVector estimate = state * (1.0 + disturbance * draw.normal());
    const MpcResult expected = exact.solve(estimate, input, cycle, power);
    visit(expected, osqp.solve(estimate, input, cycle, power));
    power = expected.power;
    state = (model_1khz().A_d * state + input * power).eval();
  }
}

TYPED_TEST(OsqpControllers, FollowTheExactSolverAtAnyTolerance) {
  double worst = 0.0;
  int relaxed = 0;
  int unsolved = 0;
  int count = 0;
  for (const int horizon : {2, 3, 5, 10, 20}) {
    for (const ControlSettings& settings : cases(horizon, horizon == 5 ? 0.1 : 1e-6)) {
      for (const double disturbance : {0.0, 0.1}) {
        compare<TypeParam>(settings, 10 + horizon, disturbance,
                           [&](const MpcResult& expected, const MpcResult& got) {
                             ++count;
                             relaxed += expected.status == MpcStatus::kRelaxed ? 1 : 0;
                             if (got.solver_status != QpStatus::kSolved) {
                               ++unsolved;
                               EXPECT_EQ(got.power, 0.0);
                               return;
                             }
                             EXPECT_EQ(got.status, expected.status);
                             worst = std::max(worst, std::abs(got.power - expected.power));
                           });
      }
    }
  }
  EXPECT_LE(worst, 1e-9);  // W
  EXPECT_LE(unsolved, 2) << "of " << count;
  EXPECT_GT(relaxed, 10);
  this->RecordProperty("worst_W", std::to_string(worst));
}

TYPED_TEST(OsqpControllers, AnswersAreInTheBoxAtTheDefaultTolerance) {
  for (const double power_min : {0.0, 0.004}) {
    for (ControlSettings settings : cases(5, 1e-3)) {
      settings.power_min = power_min;
      compare<TypeParam>(settings, 3, 0.3, [&](const MpcResult&, const MpcResult& got) {
        if (got.solver_status == QpStatus::kSolved) {
          EXPECT_GE(got.power, power_min);
          EXPECT_LE(got.power, 0.1);
        } else {
          ADD_FAILURE() << to_string(got.solver_status);
        }
      });
    }
  }
}

TYPED_TEST(OsqpControllers, ABadStateGivesNoPowerAndIsForgotten) {
  const ControlSettings settings{.horizon = 5, .osqp_tolerance = 1e-6};
  TypeParam osqp(model_1khz(), settings);
  Exact exact(model_1khz(), settings);
  Draw draw(4);
  const StateVector input = input_at(model_1khz(), 1.0);
  const StateVector warm = reachable_state(model_1khz(), draw, 20, 0.04);
  const double expected = exact.solve(warm, input, 9, 0.03).power;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    for (int i = 0; i < 6; ++i) {
      StateVector state = warm;
      state[i] = bad;
      const MpcResult spoilt = osqp.solve(state, input, 9, 0.03);
      EXPECT_EQ(spoilt.power, 0.0);
      StateVector bad_input = input;
      bad_input[i] = bad;
      const double power = osqp.solve(warm, bad_input, 9, 0.03).power;
      EXPECT_TRUE(power >= 0.0 && power <= 0.1) << power;
      EXPECT_NEAR(osqp.solve(warm, input, 9, 0.03).power, expected, 1e-5);
    }
  }
}

TYPED_TEST(OsqpControllers, AllocateNothingInTheCycle) {
  for (const int horizon : {2, 5, 20}) {
    for (const ControlSettings& settings : cases(horizon, 1e-3)) {
      TypeParam osqp(model_1khz(), settings);
      Draw draw(6);
      const StateVector cold = StateVector::Zero(6);
      const StateVector hot = reachable_state(model_1khz(), draw, 40, 0.1);
      const StateVector bad = StateVector::Constant(6, std::numeric_limits<double>::quiet_NaN());
      const StateVector input = input_at(model_1khz(), 1.0);
      const StateVector other = input_at(model_1khz(), 0.4);
      HeapUse use;
      {
        const HeapGuard guard;
        for (int cycle = 0; cycle < 6; ++cycle) {
          for (const StateVector* state : {&cold, &hot, &bad}) {
            osqp.solve(*state, input, cycle, 0.0);
            osqp.solve(*state, other, cycle, 0.05);
          }
        }
        use = guard.use();
      }
      EXPECT_EQ(use, HeapUse{}) << "N = " << horizon;
    }
  }
}

TYPED_TEST(OsqpControllers, DoNotDependOnTheReducedStatesScale) {
  int different = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const ReducedModel scaled = rescaled(model_1khz(), seed);
    const ControlSettings settings{.horizon = 5, .power_change_weight = 5e3};
    TypeParam original(model_1khz(), settings);
    TypeParam changed(scaled, settings);
    StateVector state = StateVector::Zero(6);
    StateVector scaled_state = state;
    Draw draw(seed);
    const double alpha = draw.between(0.35, 1.5);
    const StateVector input = input_at(model_1khz(), alpha);
    const StateVector scaled_input = input_at(scaled, alpha);
    double power = 0.0;
    for (int cycle = 0; cycle < 30; ++cycle) {
      const MpcResult a = original.solve(state, input, cycle, power);
      const MpcResult b = changed.solve(scaled_state, scaled_input, cycle, power);
      // The same iterates but for rounding; an iteration more or less where a residual happens to
      // equal its tolerance would show as a large difference.
      different += a.iterations != b.iterations ? 1 : 0;
      if (a.iterations == b.iterations) {
        EXPECT_NEAR(a.power, b.power, 1e-9) << seed << ", cycle " << cycle;
      }
      power = a.power;
      state = (model_1khz().A_d * state + input * power).eval();
      scaled_state = (scaled.A_d * scaled_state + scaled_input * power).eval();
    }
  }
  EXPECT_LE(different, 6);  // of 600
}

TYPED_TEST(OsqpControllers, SameHistorySameBits) {
  const ControlSettings settings{.horizon = 5};
  TypeParam one(model_1khz(), settings);
  TypeParam two(model_1khz(), settings);
  Draw draw(8);
  for (int cycle = 0; cycle < 100; ++cycle) {
    const StateVector state = reachable_state(model_1khz(), draw, 20, 0.06);
    const StateVector input = input_at(model_1khz(), draw.between(0.35, 1.5));
    const MpcResult a = one.solve(state, input, cycle, 0.03);
    const MpcResult b = two.solve(state, input, cycle, 0.03);
    ASSERT_EQ(a.power, b.power);
    ASSERT_EQ(a.iterations, b.iterations);
  }
}

TEST(OsqpWorkspace, AnInfeasibleProblemIsNotAnAnswerAndDoesNotSpoilTheNext) {
  // u in [0, 1], u <= limit.
  CondensedOsqp osqp(1e-6);
  QpProblem qp;
  qp.resize(1, 1);
  qp.hessian << 2.0;
  qp.gradient << -2.0;
  qp.lower << 0.0;
  qp.upper << 1.0;
  qp.rows << 1.0;
  qp.limit << 0.5;
  QpSolution solution;
  ASSERT_EQ(osqp.solve(qp, solution), QpStatus::kSolved);
  EXPECT_NEAR(solution.power[0], 0.5, 1e-5);
  EXPECT_LE(solution.kkt_residual, 1e-5);
  qp.limit << -0.5;
  EXPECT_EQ(osqp.solve(qp, solution), QpStatus::kInfeasible);
  EXPECT_EQ(solution.power[0], 0.0);  // OSQP itself leaves 2143289344 there
  qp.limit << 0.25;
  ASSERT_EQ(osqp.solve(qp, solution), QpStatus::kSolved);
  EXPECT_NEAR(solution.power[0], 0.25, 1e-5);
}

TEST(OsqpWorkspace, ARowOutsideThePreparedPatternIsAFailure) {
  CondensedOsqp osqp;
  osqp.prepare(2, 2, RowPattern::kLowerTriangular);
  QpProblem qp;
  qp.resize(2, 2);
  qp.hessian.setIdentity();
  qp.gradient.setConstant(-1.0);
  qp.lower.setZero();
  qp.upper.setOnes();
  qp.rows << 1.0, 0.5, 1.0, 1.0;
  qp.limit.setConstant(0.5);
  QpSolution solution;
  EXPECT_EQ(osqp.solve(qp, solution), QpStatus::kNumericalFailure);
  EXPECT_EQ(solution.power, qp.lower);
  qp.rows(0, 1) = 0.0;
  EXPECT_EQ(osqp.solve(qp, solution), QpStatus::kSolved);
}

}  // namespace
}  // namespace photocoag::testing
