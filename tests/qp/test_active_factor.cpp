// The factors of the active normals against the equations they solve, and `dense` where most of
// them come and go: every corner of the box and of a plan's rows, with any weights.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "photocoag/benchmark/qp_reference.hpp"
#include "photocoag/qp/active_factor.hpp"
#include "photocoag/qp/dense.hpp"
#include "qp/exam.hpp"

namespace photocoag::qp_exam {
namespace {

Eigen::MatrixXd columns(const std::vector<Eigen::VectorXd>& normals, int n) {
  Eigen::MatrixXd out(n, static_cast<Eigen::Index>(normals.size()));
  for (Eigen::Index k = 0; k < out.cols(); ++k) out.col(k) = normals[static_cast<std::size_t>(k)];
  return out;
}

TEST(ActiveFactor, DirectionsAndCorrectionsSolveTheirEquations) {
  Random random(41);
  int dropped = 0;
  int full = 0;
  for (const int n : {1, 2, 3, 4, 5, 9, 14, 49}) {
    for (int repeat = 0; repeat < 20; ++repeat) {
      const QpProblem qp = large_case(random, n, 0).problem;
      const Eigen::MatrixXd hessian = qp.hessian;
      HessianFactor factor;
      InputVector u(n);
      ASSERT_TRUE(factor.minimize(qp.hessian, qp.gradient, u.data()));
      factor.prepare_solutions();
      ActiveFactor active;
      active.clear(n);
      std::vector<Eigen::VectorXd> normals;
      for (int step = 0; step < 2 * n + 2; ++step) {
        // A bound, a row of the first inputs, or nearly the sum of two active normals.
        const int length = random.integer(1, n);
        Eigen::VectorXd normal = Eigen::VectorXd::Zero(n);
        const double kind = random.uniform(0.0, 1.0);
        if (kind < 0.4) {
          normal(length - 1) = random.chance(0.5) ? 1.0 : -1.0;
        } else {
          for (int j = 0; j < length; ++j) normal(j) = random.uniform(-1.0, 1.0);
        }
        if (kind > 0.8 && normals.size() >= 2) {
          normal = normals.front() + normals.back() + 1e-5 * normal;
        }
        Eigen::VectorXd wide = Eigen::VectorXd::Zero(3 * n);  // a row among others
        for (int j = 0; j < n; ++j) wide(3 * j) = 0.5 * normal(j);
        const bool bound = (normal.array() != 0.0).count() == 1;
        active.direct(factor, bound ? Normal{.index = length - 1, .scale = normal(length - 1)}
                                    : Normal{.row = wide.data(), .stride = 3, .scale = 2.0});
        const Eigen::MatrixXd before = columns(normals, n);
        const Eigen::Index q = before.cols();
        // z and r: H z + N r = n, N'z = 0. Normals that are nearly dependent make r large: what
        // may remain is rounding of the terms that cancel, times the condition of H.
        const Eigen::Map<const Eigen::VectorXd> r(active.dual(), q);
        const double terms = normal.norm() + before.norm() * r.norm();
        if (!active.dependent()) {
          const Eigen::Map<const Eigen::VectorXd> z(active.primal(), n);
          EXPECT_LE((hessian * z + before * r - normal).norm(), 1e-11 * terms) << n << ", " << q;
          EXPECT_LE((before.transpose() * z).norm(), 1e-11 * before.norm() * z.norm() + 1e-12)
              << n << ", " << q;
          EXPECT_NEAR(active.slope(), normal.dot(z), 1e-11 * (normal.norm() * z.norm()));
          active.add();
          normals.push_back(normal);
        } else {
          EXPECT_LE((before * r - normal).norm(), 1e-8 * terms) << n << ", " << q;
          full += q == n ? 1 : 0;
        }
        if (!normals.empty() && random.chance(0.3)) {
          const int position = random.integer(0, active.count() - 1);
          active.drop(position);
          normals.erase(normals.begin() + position);
          ++dropped;
        }
        ASSERT_EQ(active.count(), static_cast<int>(normals.size()));
      }
      const Eigen::MatrixXd last = columns(normals, n);
      const Eigen::Index q = last.cols();
      double e1[kMaxInputs];
      double e2[kMaxInputs];
      for (double& e : e1) e = random.uniform(-1.0, 1.0);
      for (double& e : e2) e = random.uniform(-1.0, 1.0);
      const Eigen::VectorXd old1 = Eigen::Map<Eigen::VectorXd>(e1, n);
      const Eigen::VectorXd old2 = Eigen::Map<Eigen::VectorXd>(e2, q);
      active.correct(factor, e1, e2);
      const Eigen::Map<const Eigen::VectorXd> du(e1, n);
      const Eigen::Map<const Eigen::VectorXd> dm(e2, q);
      EXPECT_LE((hessian * du + last * dm - old1).norm(), 1e-9 * std::max(1.0, dm.norm())) << n;
      EXPECT_LE((last.transpose() * du - old2).norm(), 1e-9 * std::max(1.0, du.norm())) << n;
    }
  }
  EXPECT_GT(dropped, 500);
  EXPECT_GT(full, 10);
}

// A plan's problem, built without mpc: H = 2 (G'G + R1 + R2 D'D), G from a response that decays.
QpProblem plan(int n, double decay, double power_weight, double change_weight,
               const InputVector& wish) {
  QpProblem qp;
  qp.resize(n, n);
  qp.lower.setZero();
  qp.upper.setOnes();
  qp.rows.setZero();
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j <= k; ++j) qp.rows(k, j) = 20.0 * std::pow(decay, k - j);
  }
  Eigen::MatrixXd change = Eigen::MatrixXd::Identity(n, n);
  for (int k = 1; k < n; ++k) change(k, k - 1) = -1.0;
  const Eigen::MatrixXd rows = qp.rows;
  qp.hessian = 2.0 * (rows.transpose() * rows + power_weight * Eigen::MatrixXd::Identity(n, n) +
                      change_weight * change.transpose() * change);
  qp.gradient = -qp.hessian * wish;
  qp.limit.setConstant(1e3);
  return qp;
}

TEST(DenseSolver, EveryCornerOfAPlanIsExact) {
  Random random(42);
  DenseSolver solver;
  QpSolution solution;
  double worst = 0.0;
  int most_active = 0;
  int with_rows = 0;
  for (const int n : {1, 2, 3, 4, 5, 9, 14, 19, 49}) {
    const int corners = n <= 4 ? 1 << (2 * n) : 100;
    for (int corner = 0; corner < corners; ++corner) {
      for (const double weight : {0.0, 5.0}) {
        InputVector wish(n);  // each input below, above or inside of its bounds
        for (int j = 0; j < n; ++j) {
          const int place = n <= 4 ? (corner >> (2 * j)) & 3 : random.integer(0, 3);
          wish(j) = place == 0 ? -1.5 : place == 1 ? 2.5 : random.uniform(0.1, 0.9);
        }
        QpProblem qp = plan(n, random.uniform(0.3, 0.95), weight, 3.0 * weight, wish);
        if (corner % 2 == 1) {  // the last stages first, then all
          const double level = random.uniform(2.0, 15.0);
          for (int k = corner % 4 == 1 ? n / 2 : 0; k < n; ++k) qp.limit(k) = level;
        }
        ASSERT_EQ(solver.solve(qp, solution), QpStatus::kSolved) << n << ", " << corner;
        const auto truth = reference_minimizer(qp, solution, 1e-12L);
        ASSERT_TRUE(truth) << n << ", " << corner;
        for (int j = 0; j < n; ++j) {
          worst =
              std::max(worst, static_cast<double>(std::fabs(truth->power[j] - solution.power(j))));
        }
        const int rows = static_cast<int>((solution.row_multiplier.array() > 0.0).count());
        with_rows += rows > 0 ? 1 : 0;
        most_active =
            std::max(most_active,
                     rows + static_cast<int>((solution.bound_multiplier.array() != 0.0).count()));
      }
    }
  }
  RecordProperty("worst_error", std::to_string(worst));
  EXPECT_LE(worst, 1e-12);
  EXPECT_GT(most_active, 30);
  EXPECT_GT(with_rows, 100);
}

// N = 2 has a closed form. A second row without a limit leads past it: the same answers.
TEST(DenseSolver, OneInputAndOneRowAreAsInTheGeneralCase) {
  Random random(43);
  DenseSolver solver;
  QpSolution single;
  QpSolution general;
  int bound = 0;
  int row = 0;
  int inside = 0;
  int none = 0;
  for (int k = 0; k < 4000; ++k) {
    QpProblem one = random_case(random, 1, 1).problem;
    if (k % 7 == 0) one.rows(0, 0) = 0.0;
    if (k % 11 == 0) one.limit(0) = one.rows(0, 0) * one.upper(0);
    QpProblem two = one;
    two.resize(1, 2);
    two.hessian = one.hessian;
    two.gradient = one.gradient;
    two.lower = one.lower;
    two.upper = one.upper;
    two.rows << one.rows(0, 0), 1.0;
    two.limit << one.limit(0), std::numeric_limits<double>::infinity();
    const QpStatus status = solver.solve(one, single);
    ASSERT_EQ(status, solver.solve(two, general)) << k;
    if (status != QpStatus::kSolved) {
      ++none;
      continue;
    }
    EXPECT_NEAR(single.power(0), general.power(0), 1e-13) << k;
    EXPECT_LE(single.iterations, general.iterations) << k;
    EXPECT_EQ(single.iterations > 0, general.iterations > 0) << k;
    EXPECT_LE(single.kkt_residual, 1e-14) << k;
    bound += single.bound_multiplier(0) != 0.0 ? 1 : 0;
    row += single.row_multiplier(0) > 0.0 ? 1 : 0;
    inside += single.iterations == 0 ? 1 : 0;
  }
  EXPECT_GT(std::min({bound, row, inside, none}), 100);
  DenseSolver none_allowed(0);
  QpProblem qp = plan(1, 0.5, 0.0, 0.0, InputVector::Constant(1, 2.0));
  EXPECT_EQ(none_allowed.solve(qp, single), QpStatus::kIterationLimit);
}

}  // namespace
}  // namespace photocoag::qp_exam
