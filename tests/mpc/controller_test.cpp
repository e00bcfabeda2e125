// The model predictive controller: the minimizer, its safe answers, and what it must not depend on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mpc/paper_cost.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/mpc/mpc.hpp"
#include "qp/oracle.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

using Mpc = ModelPredictiveController<DenseSolver>;

/// Weights the paper uses, and none.
std::vector<ControlSettings> settings_of_the_paper(int horizon) {
  ControlSettings plain{.horizon = horizon};
  std::vector<ControlSettings> all(5, plain);
  all[1].power_weight = 5e4;
  all[2].power_change_weight = 5e4;
  all[3].state_weight = StateWeight::kDelayed;
  all[3].power_weight = 5e1;
  all[4].state_weight = StateWeight::kDelayed;
  all[4].power_change_weight = 5e1;
  return all;
}

TEST(Mpc, FirstPowerIsTheOneOfTheEnumeratedMinimizer) {
  Draw draw(1);
  int at_limit = 0;
  int at_bound = 0;
  for (int horizon = 2; horizon <= 5; ++horizon) {
    for (const ControlSettings& settings : settings_of_the_paper(horizon)) {
      Mpc mpc(model_1khz(), settings);
      for (int repeat = 0; repeat < 40; ++repeat) {
        const StateVector state =
            reachable_state(model_1khz(), draw, draw.integer(0, 60), draw.between(0.0, 0.1));
        const StateVector input = input_at(model_1khz(), draw.between(0.2, 2.0));
        const MpcResult result =
            mpc.solve(state, input, draw.integer(0, 5), draw.between(0.0, 0.1));
        ASSERT_EQ(result.solver_status, QpStatus::kSolved);
        // Relaxed rows touch the box in one corner only: the oracle needs room for its own
        // rounding.
        const qp_exam::Truth truth = qp_exam::Oracle(mpc.problem(), 1e-13L).solve();
        ASSERT_TRUE(truth.feasible);
        // 1e-9 of the range: the room given to the rows, times the condition of a plan without
        // penalties.
        ASSERT_NEAR(result.power, static_cast<double>(truth.power[0]) * 0.1, 1e-9 * 0.1)
            << "N " << horizon << ", R1 " << settings.power_weight << ", R2 "
            << settings.power_change_weight;
        at_limit += result.limit_active ? 1 : 0;
        at_bound += result.power == 0.0 || result.power == 0.1 ? 1 : 0;
      }
    }
  }
  // The sample must have met what is hard.
  EXPECT_GT(at_limit, 50);
  EXPECT_GT(at_bound, 100);
}

TEST(Mpc, WithoutPenaltiesHorizonTwoIsTheClippedDeadbeatPower) {
  Mpc mpc(model_1khz(), {.horizon = 2});
  Draw draw(3);
  int inside = 0;
  for (int repeat = 0; repeat < 1000; ++repeat) {
    const StateVector state = reachable_state(model_1khz(), draw, 30, draw.between(0.0, 0.1));
    const StateVector input = input_at(model_1khz(), draw.between(0.2, 2.0));
    const double free = model_1khz().C_peak.dot(model_1khz().A_d * state);
    const double gain = model_1khz().C_peak.dot(input);
    const double deadbeat = std::clamp((30.0 - free) / gain, 0.0, 0.1);
    const MpcResult result = mpc.solve(state, input, repeat, 0.03);
    // 1e-13 relative in each of a few sums of some 30 K over 100 K/W.
    ASSERT_NEAR(result.power, deadbeat, 1e-12);
    inside += result.power > 0.0 && result.power < 0.1 ? 1 : 0;
  }
  EXPECT_GT(inside, 100);
}

TEST(Mpc, NoStateMakesTheProblemUnsolvable) {
  for (const double power_min : {0.0, 0.004}) {
    for (const int horizon : {2, 5, 20, 50}) {
      for (ControlSettings settings : settings_of_the_paper(horizon)) {
        settings.power_min = power_min;
        Mpc mpc(model_1khz(), settings);
        Draw draw(17 + horizon);
        int relaxed = 0;
        const int repeats = horizon <= 5 ? 1000 : 50;
        for (int repeat = 0; repeat < repeats; ++repeat) {
          // Any direction, from cold to peaks of some 1e5 K.
          StateVector state = reachable_state(model_1khz(), draw, 20, 0.1);
          const StateVector noise =
              StateVector::NullaryExpr(6, [&] { return draw.normal() * state.norm(); });
          state =
              (state + draw.between(0.0, 1.0) * noise) * std::pow(10.0, draw.between(-3.0, 4.0));
          const StateVector input = input_at(model_1khz(), draw.between(0.2, 2.0));
          const MpcResult result = mpc.solve(state, input, repeat, draw.between(0.0, 0.1));
          ASSERT_EQ(result.solver_status, QpStatus::kSolved)
              << to_string(result.solver_status) << ", N " << horizon << ", repeat " << repeat
              << ", R1 " << settings.power_weight << ", R2 " << settings.power_change_weight
              << ", peak " << model_1khz().C_peak.dot(state);
          ASSERT_GE(result.power, power_min);
          ASSERT_LE(result.power, 0.1);
          bool above = false;
          for (int k = 1; k < horizon; ++k) above = above || mpc.ocp().free_response(k) > 32.0;
          ASSERT_EQ(result.status, above ? MpcStatus::kRelaxed : MpcStatus::kSolved);
          if (above) {
            // Heating never cools: any power now would raise a peak that is too high already.
            ASSERT_NEAR(result.power, power_min, 1e-12);
            ++relaxed;
          }
        }
        EXPECT_GT(relaxed, repeats / 10);
      }
    }
  }
}

TEST(Mpc, PlanKeepsTheLimitOfItsOwnModel) {
  Draw draw(23);
  int active = 0;
  for (int repeat = 0; repeat < 500; ++repeat) {
    // A penalty on changes after full power drives the plan against the limit.
    const ControlSettings settings{.horizon = 10, .power_change_weight = 5e4};
    Mpc mpc(model_1khz(), settings);
    const StateVector state = reachable_state(model_1khz(), draw, 12, 0.08);
    const Instance ocp{.model = model_1khz(),
                       .settings = settings,
                       .state = state,
                       .input = input_at(model_1khz(), draw.between(0.7, 1.5))};
    const MpcResult result = mpc.solve(state, ocp.input, 5, 0.1);
    ASSERT_EQ(result.solver_status, QpStatus::kSolved);
    const Real next = simulated_peaks(ocp, {result.power})[0];
    const Real least = simulated_peaks(ocp, {0.0L})[0];
    // The solver's rows hold to rounding, 1e-13 of their scale.
    ASSERT_LE(static_cast<double>(next), std::max(32.0, static_cast<double>(least)) + 1e-10);
    active += result.limit_active ? 1 : 0;
  }
  EXPECT_GT(active, 50);
}

TEST(Mpc, PreviousPowerOfCycleZeroIsTheReferencePower) {
  const ControlSettings settings{.horizon = 5, .power_change_weight = 5e4};
  const StateVector state = StateVector::Zero(6);
  const StateVector input = input_at(model_1khz(), 0.7363);
  Mpc first(model_1khz(), settings);
  const MpcResult with_zero = first.solve(state, input, 0, 0.0);
  const MpcResult with_full = first.solve(state, input, 0, 0.1);
  EXPECT_EQ(with_zero.power, with_full.power);
  const double reference = first.ocp().steady_power(input);
  EXPECT_EQ(with_zero.power_reference, reference);
  // Constant R0: the cycle has no other effect.
  EXPECT_EQ(first.solve(state, input, 1, reference).power, with_zero.power);
  EXPECT_NE(first.solve(state, input, 1, 0.0).power, with_zero.power);
}

TEST(Mpc, ResultsDoNotDependOnTheReducedStatesScale) {
  Draw draw(31);
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const ReducedModel scaled = rescaled(model_1khz(), seed);
    for (const ControlSettings& settings : settings_of_the_paper(draw.integer(2, 12))) {
      Mpc original(model_1khz(), settings);
      Mpc changed(scaled, settings);
      // The same history in both coordinates.
      const double alpha = draw.between(0.3, 1.7);
      const StateVector input = input_at(model_1khz(), alpha);
      const StateVector scaled_input = input_at(scaled, alpha);
      StateVector state = StateVector::Zero(6);
      StateVector scaled_state = StateVector::Zero(6);
      const double top = draw.between(0.0, 0.1);
      for (int k = 0; k < 20; ++k) {
        const double power = draw.between(0.0, top);
        state = (model_1khz().A_d * state + input * power).eval();
        scaled_state = (scaled.A_d * scaled_state + scaled_input * power).eval();
      }
      const MpcResult a = original.solve(state, input, 4, 0.02);
      const MpcResult b = changed.solve(scaled_state, scaled_input, 4, 0.02);
      // Rounding of the transformed data, 1e-15, times the condition of a plan without penalties,
      // up to 1e5.
      ASSERT_NEAR(a.power, b.power, 1e-9 * 0.1) << seed;
      ASSERT_NEAR(a.power_reference, b.power_reference, 1e-10 * 0.1);
      ASSERT_EQ(a.status, b.status);
      ASSERT_EQ(a.limit_active, b.limit_active);
    }
  }
}

TEST(Mpc, ABadStateGivesNoPower) {
  constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()};
  for (const ControlSettings& settings : settings_of_the_paper(5)) {
    Mpc mpc(model_1khz(), settings);
    const StateVector good = StateVector::Zero(6);
    const StateVector input = input_at(model_1khz(), 1.0);
    const MpcResult before = mpc.solve(good, input, 7, 0.03);
    for (const double bad : kBad) {
      for (int i = 0; i < 6; ++i) {
        StateVector state = good;
        state[i] = bad;
        MpcResult result = mpc.solve(state, input, 7, 0.03);
        EXPECT_EQ(result.status, MpcStatus::kFailed);
        EXPECT_EQ(result.power, 0.0);
        StateVector bad_input = input;
        bad_input[i] = bad;
        result = mpc.solve(good, bad_input, 7, 0.03);
        EXPECT_EQ(result.status, MpcStatus::kFailed);
        EXPECT_EQ(result.power, 0.0);
      }
      if (settings.power_change_weight > 0.0) {
        EXPECT_EQ(mpc.solve(good, input, 7, bad).power, 0.0);
      }
    }
    // And the next cycle is untouched by it.
    EXPECT_EQ(mpc.solve(good, input, 7, 0.03).power, before.power);
  }
}

// The solver's answer is good, its check says no.
struct DoubtsItself {
  DenseSolver solver;
  QpStatus solve(const QpProblem& problem, QpSolution& solution) noexcept {
    solver.solve(problem, solution);
    return solution.status = QpStatus::kKktFailed;
  }
};

TEST(Mpc, AnAnswerThatFailsItsCheckGivesNoPowerAndAStatusOfItsOwn) {
  ModelPredictiveController<DoubtsItself> mpc(model_1khz(), {.horizon = 5});
  const StateVector cold = StateVector::Zero(6);
  const MpcResult result = mpc.solve(cold, input_at(model_1khz(), 1.0), 0, 0.0);
  EXPECT_EQ(result.status, MpcStatus::kKktFailed);
  EXPECT_EQ(to_string(result.status), "kkt_failed");
  EXPECT_EQ(result.solver_status, QpStatus::kKktFailed);
  EXPECT_EQ(result.power, 0.0);
}

TEST(Mpc, AllocatesNothing) {
  for (const int horizon : {2, 5, 50}) {
    Mpc mpc(model_1khz(), {.horizon = horizon, .power_change_weight = 5e4});
    Draw draw(6);
    const StateVector cold = StateVector::Zero(6);
    const StateVector hot = reachable_state(model_1khz(), draw, 40, 0.1);
    const StateVector bad = StateVector::Constant(6, std::numeric_limits<double>::quiet_NaN());
    const StateVector input = input_at(model_1khz(), 1.0);
    double sum = 0.0;
    HeapUse use;
    {
      const HeapGuard guard;
      for (const StateVector* state : {&cold, &hot, &bad}) {
        sum += mpc.solve(*state, input, 0, 0.0).power;
        sum += mpc.solve(*state, input, 3, 0.05).power;
      }
      use = guard.use();
    }
    EXPECT_EQ(use, HeapUse{});
    EXPECT_GT(sum, 0.0);
  }
}

// The paper: u_prev of the first iteration is u_ref. A delayed controller's first plan is for
// period 1 and no exception: from 0 W instead it would begin with other powers.
TEST(Mpc, TheFirstPlanStartsFromTheReferencePowerDelayedOrNot) {
  for (const int delay : {0, 1}) {
    ControlSettings settings{.horizon = 5, .power_change_weight = 5e4};
    settings.delay = delay;
    const EstimatorSettings estimator;
    Controller controller(model_1khz(), settings, estimator);
    const StateVector cold = StateVector::Zero(model_1khz().order());
    const StateVector input = input_at(model_1khz(), estimator.absorption_initial);
    Mpc mpc(model_1khz(), settings);
    const double reference = mpc.ocp().steady_power(input, delay);
    const double wanted = mpc.solve(cold, input, 1, reference).power;
    EXPECT_GT(std::abs(wanted - mpc.solve(cold, input, 1, 0.0).power), 1e-4);
    EXPECT_NEAR(controller.decide().power, wanted, 1e-12) << "delay " << delay;
  }
}

}  // namespace
}  // namespace photocoag::testing
