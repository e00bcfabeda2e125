// `dense` against a reference of 18 digits: u0 of 10,000 closed-loop problems, N from 2 to 50.
#include <gtest/gtest.h>

#include <cmath>

#include "estimation/test_models.hpp"
#include "photocoag/benchmark/qp_reference.hpp"
#include "photocoag/benchmark/recording.hpp"
#include "photocoag/mpc/mpc.hpp"
#include "qp/exam.hpp"

namespace photocoag::testing {
namespace {

struct Tally {
  int problems = 0;
  int without_reference = 0;
  int constrained = 0;  // something is active
  int relaxed = 0;
  double worst_error = 0.0;       // of u0, W
  double worst_iterations = 0.0;  // over the bound
};

void replay(const RecordedLoop& loop, const ControlSettings& settings, double disturbance,
            Tally& tally) {
  OptimalControlProblem ocp(model_1khz(), settings);
  DenseSolver solver;
  QpProblem problem;
  QpSolution solution;
  Draw draw(99);
  for (std::size_t n = 0; n < loop.cycles.size(); ++n) {
    const RecordedCycle& c = loop.cycles[n];
    const StateVector state = c.state * (1.0 + disturbance * draw.normal());
    const double reference = ocp.steady_power(c.input);
    ocp.condense({.state = state,
                  .input = c.input,
                  .cycle = static_cast<long long>(n),
                  .power_reference = reference,
                  .previous_power = n == 0 ? reference : c.previous_power},
                 problem);
    ASSERT_EQ(solver.solve(problem, solution), QpStatus::kSolved);
    ++tally.problems;
    tally.relaxed += ocp.limit_relaxed() ? 1 : 0;
    const bool active = solution.bound_multiplier.any() || solution.row_multiplier.any();
    tally.constrained += active ? 1 : 0;
    const int inputs = ocp.inputs();
    tally.worst_iterations =
        std::max(tally.worst_iterations, static_cast<double>(solution.iterations) /
                                             DenseSolver::iteration_bound(inputs, inputs));
    const auto truth = reference_minimizer(problem, solution);
    if (!truth) {
      ++tally.without_reference;
      continue;
    }
    const double error = static_cast<double>(std::fabs(truth->power[0] - solution.power[0]));
    tally.worst_error = std::max(tally.worst_error, error * settings.power_max);
  }
}

TEST(DenseReference, FirstPowerOfTenThousandClosedLoopProblems) {
  Tally tally;
  for (const int horizon : {2, 3, 4, 5, 6, 8, 10, 13, 15, 20, 25, 30, 40, 50}) {
    const int cycles = horizon <= 10 ? 40 : horizon <= 20 ? 30 : 15;
    for (const double alpha : {0.35, 0.7363, 1.1, 1.5}) {
      std::vector<ControlSettings> all(4, ControlSettings{.horizon = horizon});
      all[1].power_weight = 5e4;
      all[2].power_change_weight = 5e4;
      all[3].state_weight = StateWeight::kDelayed;
      all[3].power_weight = 5e1;
      for (const ControlSettings& settings : all) {
        SimulatedEye<ReducedPlant> eye(ReducedPlant(model_1khz(), alpha), 0.288, 5);
        const RecordedLoop loop = record_loop(model_1khz(), settings, {}, eye, alpha, cycles);
        replay(loop, settings, 0.0, tally);
        replay(loop, settings, 0.5, tally);  // estimates far off: limits and bounds active, relaxed
      }
    }
  }
  RecordProperty("problems", tally.problems);
  RecordProperty("worst_error_W", std::to_string(tally.worst_error));
  EXPECT_GE(tally.problems, 10000);
  EXPECT_EQ(tally.without_reference, 0);
  EXPECT_LE(tally.worst_error, 1e-9);
  EXPECT_GT(tally.constrained, 1000);
  EXPECT_GT(tally.relaxed, 200);
  EXPECT_LT(tally.worst_iterations, 0.25);
}

// Every row twice, once in other units, rows that repeat a bound, and sums of rows: active sets
// with dependent normals at every size, on problems whose minimizer is far outside the box.
TEST(DenseReference, LargeProblemsWithDuplicateAndDependentRows) {
  qp_exam::Random random(31);
  DenseSolver solver;
  QpSolution solution;
  int without_reference = 0;
  int rows_active = 0;
  int count = 0;
  for (int repeat = 0; repeat < 300; ++repeat) {
    const int n = random.integer(2, kMaxInputs);
    const int half = random.integer(1, kMaxInputs / 2);
    QpProblem qp = qp_exam::large_case(random, n, half).problem;
    qp.rows.conservativeResize(2 * half, n);
    qp.limit.conservativeResize(2 * half);
    for (int i = 0; i < half; ++i) {
      const double kind = random.uniform(0.0, 1.0);
      if (kind < 0.4) {  // the same, in other units
        qp.rows.row(half + i) = 1024.0 * qp.rows.row(i);
        qp.limit(half + i) = 1024.0 * qp.limit(i);
      } else if (kind < 0.7) {  // a bound again
        const int j = random.integer(0, n - 1);
        qp.rows.row(half + i).setZero();
        qp.rows(half + i, j) = 1.0;
        qp.limit(half + i) = qp.upper(j);
      } else {  // implied by two others
        const int other = random.integer(0, half - 1);
        qp.rows.row(half + i) = qp.rows.row(i) + qp.rows.row(other);
        qp.limit(half + i) = qp.limit(i) + qp.limit(other);
      }
    }
    ASSERT_EQ(solver.solve(qp, solution), QpStatus::kSolved) << repeat;
    ++count;
    rows_active += solution.row_multiplier.any() ? 1 : 0;
    const auto truth = reference_minimizer(qp, solution, 1e-12L);
    if (!truth) {
      ++without_reference;
      continue;
    }
    for (int j = 0; j < n; ++j) {
      // The rows hold to 1e-13 of their scale, times the condition of H, up to 1e4.
      EXPECT_LE(std::fabs(truth->power[j] - solution.power[j]), 1e-9) << repeat << ", u" << j;
    }
  }
  EXPECT_EQ(without_reference, 0) << "of " << count;
  EXPECT_GT(rows_active, 200);
}

TEST(DenseReference, RefusesAWrongActiveSet) {
  qp_exam::Random random(32);
  DenseSolver solver;
  QpSolution solution;
  const QpProblem qp = qp_exam::large_case(random, 8, 8).problem;
  ASSERT_EQ(solver.solve(qp, solution), QpStatus::kSolved);
  ASSERT_TRUE(reference_minimizer(qp, solution));
  QpSolution wrong = solution;
  int j = 0;
  while (wrong.bound_multiplier(j) == 0.0) ++j;
  wrong.bound_multiplier(j) *= -1.0;  // the other bound
  EXPECT_FALSE(reference_minimizer(qp, wrong));
  wrong = solution;
  wrong.bound_multiplier(j) = 0.0;  // not active
  EXPECT_FALSE(reference_minimizer(qp, wrong));
}

}  // namespace
}  // namespace photocoag::testing
