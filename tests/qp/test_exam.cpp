// The exam for every solver: a new solver adds its Tolerances and its type to Solvers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#if PHOTOCOAG_HAS_OSQP
#include "photocoag/core/types.hpp"
#include "photocoag/osqp/condensed.hpp"
#endif
#include "photocoag/qp/dense.hpp"
#include "qp/exam.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::qp_exam {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <typename Solver>
struct Promise;

template <>
struct Promise<DenseSolver> {
  static constexpr bool kExact = true;  // same problem, same bits; and from any size, no heap
  static constexpr double kMostGivenUp = 0.0;
  static constexpr Tolerances kTolerances{
      .power = 1e-12,  // documented accuracy
      .stationarity =
          1e-13,             // some 50 roundings of 1e-16 each, and the condition of the active set
      .feasibility = 2e-13,  // the threshold at which a constraint is taken up, and rounding
      .infeasibility = 1e-9};  // documented
};

#if PHOTOCOAG_HAS_OSQP
// OSQP promises less: an answer to its tolerance, or none.
struct TightOsqp : CondensedOsqp {
  TightOsqp() : CondensedOsqp(1e-6) {}
};
template <>
struct Promise<TightOsqp> {
  static constexpr bool kExact = false;
  static constexpr double kMostGivenUp = 0.01;
  static constexpr Tolerances kTolerances{
      .power = 1e-3,         // the tolerance times the condition that an objective may have, 1e3
      .stationarity = 1e-4,  // OSQP's criterion is absolute where the terms that cancel are small
      .feasibility = 1e-4,
      .infeasibility = 1e-3,  // ten times OSQP's eps_prim_inf
      .thin = 1e-3,
      .may_give_up = true};
};
#endif

template <typename SolverType>
class QpExam : public ::testing::Test {
 protected:
  static constexpr Tolerances kTolerances = Promise<SolverType>::kTolerances;
  static constexpr bool kExact = Promise<SolverType>::kExact;

  void TearDown() override {
    EXPECT_LE(given_up_, std::ceil(Promise<SolverType>::kMostGivenUp * passed_));
  }

  // Solves, judges, returns the first power.
  double pass(const Case& c) {
    const QpStatus status = solver_->solve(c.problem, *solution_);
    const std::string complaint = judge(c, status, *solution_, kTolerances);
    EXPECT_EQ(complaint, "");
    ++passed_;
    given_up_ +=
        status == QpStatus::kIterationLimit || (!kExact && status == QpStatus::kKktFailed) ? 1 : 0;
    return solution_->power(0);
  }
  double pass_with_oracle(Case c) {
    consult_oracle(c, kTolerances);
    ++count_[int(c.expected)];
    return pass(c);
  }

  std::unique_ptr<SolverType> solver_ = std::make_unique<SolverType>();
  std::unique_ptr<QpSolution> solution_ = std::make_unique<QpSolution>();
  int count_[4] = {};  // by Expected
  int passed_ = 0;
  int given_up_ = 0;
};

#if PHOTOCOAG_HAS_OSQP
using Solvers = ::testing::Types<DenseSolver, TightOsqp>;
#else
using Solvers = ::testing::Types<DenseSolver>;
#endif
TYPED_TEST_SUITE(QpExam, Solvers);

static_assert(QpSolver<DenseSolver>);

Case small_case() {
  Random random(7);
  Case c = random_case(random, 3, 2);
  QpProblem& qp = c.problem;
  qp.lower.setZero();
  qp.upper.setOnes();
  qp.rows.setOnes();
  qp.rows(1, 2) = -1.0;
  qp.limit << 1.5, 0.5;
  c.expected = Expected::kSolved;
  return c;
}

TYPED_TEST(QpExam, MatchesEnumerationOnRandomProblems) {
  Random random(1);
  for (int k = 0; k < 4000; ++k) {
    this->pass_with_oracle(random_case(random, random.integer(1, 4), random.integer(0, 4)));
  }
  for (int k = 0; k < 150; ++k) this->pass_with_oracle(random_case(random, 5, 5));
  EXPECT_GT(this->count_[int(Expected::kSolved)], 2000);
  EXPECT_GT(this->count_[int(Expected::kInfeasible)], 200);
}

TYPED_TEST(QpExam, MatchesEnumerationOnDegenerateProblems) {
  Random random(2);
  for (int k = 0; k < 4000; ++k) this->pass_with_oracle(degenerate_case(random));
  EXPECT_GT(this->count_[int(Expected::kSolved)], this->kExact ? 2000 : 1000);  // no thin sets
  EXPECT_GT(this->count_[int(Expected::kInfeasible)], 200);
  if (this->kTolerances.thin == 0) {
    EXPECT_EQ(this->count_[int(Expected::kEither)], 0);  // the data are exact
  }
}

TYPED_TEST(QpExam, TellsNearlyInfeasibleFromInfeasible) {
  Random random(3);
  for (int k = 0; k < 2000; ++k) {
    // Thin feasible sets, empty sets by a little, and every gap down to rounding.
    const double size = std::pow(10.0, random.uniform(-16, -1));
    this->pass_with_oracle(nearly_infeasible_case(random, random.chance(0.5) ? size : -size));
  }
  for (const auto expected : {Expected::kSolved, Expected::kInfeasible, Expected::kEither}) {
    EXPECT_GT(this->count_[int(expected)], this->kExact ? 300 : 50);
  }
}

TYPED_TEST(QpExam, MatchesEnumerationInClosedLoop) {
  int active = 0;
  for (int horizon = 2; horizon <= 6; ++horizon) {
    // A quiet loop, and two whose estimate is so noisy that limits and bounds are active.
    const int cycles = horizon == 6 ? 40 : 150;
    const Application applications[] = {{.horizon = horizon, .cycles = cycles},
                                        {.horizon = horizon, .cycles = cycles, .disturbance_K = 8},
                                        {.horizon = horizon,
                                         .power_weight = 1,
                                         .change_weight = 10,
                                         .delayed = true,
                                         .cycles = cycles,
                                         .disturbance_K = 8}};
    for (const Application& a : applications) {
      run_application(a, 10 + horizon, [&](const Case& c) {
        Case checked = c;
        consult_oracle(checked, this->kTolerances);
        if (checked.expected != Expected::kEither) {
          EXPECT_EQ(checked.expected, c.expected);
        }
        ++this->count_[int(c.expected)];
        const double power = this->pass(checked);
        if (this->solution_->bound_multiplier.any() || this->solution_->row_multiplier.any())
          ++active;
        return power;
      });
    }
  }
  EXPECT_GT(this->count_[int(Expected::kSolved)], 1000);
  EXPECT_GT(active, 400);
}

TYPED_TEST(QpExam, SatisfiesKktInClosedLoopWithLongHorizons) {
  for (const int horizon : {2, 10, 20, 35, 50}) {
    for (const double weight : {0.0, 1e-3, 1.0, 100.0}) {
      run_application({.horizon = horizon,
                       .power_weight = weight,
                       .change_weight = 10 * weight,
                       .delayed = weight > 0,
                       .cycles = 40,
                       .disturbance_K = 10},
                      20, [&](const Case& c) {
                        ++this->count_[int(c.expected)];
                        return this->pass(c);
                      });
    }
  }
  EXPECT_GT(this->count_[int(Expected::kSolved)], 400);
  EXPECT_GT(this->count_[int(Expected::kInfeasible)], 20);  // the disturbance may exceed the limit
}

TYPED_TEST(QpExam, SolvesEverySize) {
  Random random(4);
  for (int n = 1; n <= kMaxInputs; ++n) {
    for (const int m : {0, 1, n, kMaxInputs}) this->pass(large_case(random, n, m));
  }
}

TYPED_TEST(QpExam, SolvesWithoutConstraintsInReach) {
  // The minimizer is inside: u = -H^-1 g, known in advance.
  Case c = small_case();
  c.problem.limit.setConstant(kInfinity);
  c.power = {0.25L, 0.5L, 0.75L};
  InputVector u(3);
  u << 0.25, 0.5, 0.75;
  c.problem.gradient = -c.problem.hessian * u;
  this->pass(c);
}

TYPED_TEST(QpExam, FixedInputsStayFixed) {
  Random random(5);
  for (int k = 0; k < 300; ++k) {
    Case c = random_case(random, 4, 3);
    for (int j = 0; j < 4; ++j) {
      if (random.chance(0.5)) c.problem.upper(j) = c.problem.lower(j);
    }
    this->pass_with_oracle(c);
  }
  Case all = random_case(random, 4, 0);  // nothing is free
  all.problem.upper = all.problem.lower;
  this->pass_with_oracle(all);
  all.problem.lower.setZero();  // and there is no scale
  all.problem.upper.setZero();
  this->pass_with_oracle(all);
}

TYPED_TEST(QpExam, RedundantConstraintsAtAVertex) {
  // More constraints through one point than inputs, in every order: u = (1, 1)/2 at the end.
  Case c{.name = "vertex"};
  QpProblem& qp = c.problem;
  qp.resize(2, 5);
  qp.hessian << 2, 1, 1, 3;
  qp.gradient << -20, -20;
  qp.lower.setZero();
  qp.upper.setConstant(0.5);
  qp.rows << 1, 0, 0, 1, 1, 1, 2, 1, 1, 2;
  qp.limit << 0.5, 0.5, 1, 1.5, 1.5;
  c.power = {0.5L, 0.5L};
  Eigen::Matrix<int, 5, 1> order(0, 1, 2, 3, 4);
  do {
    Case shuffled = c;
    for (int i = 0; i < 5; ++i) {
      shuffled.problem.rows.row(i) = qp.rows.row(order(i));
      shuffled.problem.limit(i) = qp.limit(order(i));
    }
    this->pass(shuffled);
  } while (std::next_permutation(order.data(), order.data() + 5));
}

TYPED_TEST(QpExam, AnswerDoesNotDependOnUnits) {
  Random random(6);
  QpSolution scaled;
  for (int k = 0; k < 500; ++k) {
    Case c = random_case(random, 4, 4);
    consult_oracle(c, this->kTolerances);
    this->pass(c);
    const QpSolution& base = *this->solution_;
    QpProblem qp = c.problem;
    for (int i = 0; i < 4; ++i) qp = with_row_scaled(qp, i, std::pow(10.0, random.uniform(-6, 6)));
    qp = with_objective_scaled(qp, std::pow(10.0, random.uniform(-8, 8)));
    this->solver_->solve(qp, scaled);
    // Infeasible by less than what must be noticed: rounding may decide.
    if (c.expected == Expected::kEither) continue;
    if (this->kExact) {
      EXPECT_EQ(scaled.status, base.status);
    }
    // Rounding of the factors moves the data by 1e-16 and u by the condition number times that.
    const double allowed = this->kTolerances.power * std::max(1.0, c.condition / 1e3);
    if (!this->kExact && scaled.status != base.status) continue;
    EXPECT_LE((scaled.power - base.power).cwiseAbs().maxCoeff(), allowed);
  }
}

TYPED_TEST(QpExam, IllConditionedHessian) {
  Random random(8);
  for (int k = 0; k < 1000; ++k) {
    Case c = ill_conditioned_case(random, std::pow(10.0, random.uniform(3, 10)));
    Case truth = c;
    consult_oracle(truth, this->kTolerances);
    c.expected = truth.expected;
    this->pass(c);  // KKT conditions; u itself is not determined better than condition * 1e-16
  }
}

TYPED_TEST(QpExam, RejectsBadNumbersAndForgetsThem) {
  const Case good = small_case();
  this->pass(good);
  const QpSolution expected = *this->solution_;
  int bad = 0;
  const auto spoil = [&](auto member) {
    const int size = int((good.problem.*member).size());
    for (int k = 0; k < size; ++k) {
      for (const double value : {kNan, kInfinity, -kInfinity}) {
        Case c = good;
        (c.problem.*member).data()[k] = value;
        c.expected = Expected::kFailure;
        if constexpr (std::is_same_v<decltype(member), decltype(&QpProblem::limit)>) {
          if (&(c.problem.*member) == &c.problem.limit && value == kInfinity)
            continue;  // no constraint
        }
        this->pass(c);
        ++bad;
        this->pass(good);
        if (!this->kExact) continue;
        EXPECT_EQ(this->solution_->power, expected.power);
        EXPECT_EQ(this->solution_->row_multiplier, expected.row_multiplier);
      }
    }
  };
  spoil(&QpProblem::hessian);
  spoil(&QpProblem::gradient);
  spoil(&QpProblem::lower);
  spoil(&QpProblem::upper);
  spoil(&QpProblem::rows);
  spoil(&QpProblem::limit);
  EXPECT_EQ(bad, 3 * (9 + 3 + 3 + 3 + 6 + 2) - 2);
}

TYPED_TEST(QpExam, RejectsWhatIsNotConvex) {
  const Case good = small_case();
  const auto reject = [&](double a, double b, double c) {
    Case bad{.name = "not convex", .problem = good.problem, .expected = Expected::kFailure};
    bad.problem.hessian << a, b, 0, b, c, 0, 0, 0, 1;
    this->pass(bad);
  };
  reject(-1, 0, 1);
  reject(1, 0, -1);
  reject(0, 0, 1);
  reject(1, 2, 1);
  reject(1, 1, 1);          // semidefinite: the minimizer is not unique
  reject(1, 1, 1 + 1e-15);  // definite by a rounding error only
}

TYPED_TEST(QpExam, AnEmptyBoxIsInfeasible) {
  Case c = small_case();
  c.problem.upper(1) = c.problem.lower(1) - 0.5;
  c.expected = Expected::kInfeasible;
  this->pass(c);
}

TYPED_TEST(QpExam, SameProblemSameBits) {
  Random random(9);
  for (int k = 0; k < 50; ++k) {
    const Case c = large_case(random, random.integer(1, kMaxInputs), random.integer(0, kMaxInputs));
    this->pass(c);
    const QpSolution first = *this->solution_;
    // Another solver object, a solver that has seen another problem, and data at another alignment:
    // vectorized sums that start at an aligned address would differ in the last bit.
    auto fresh = std::make_unique<TypeParam>();
    for (const std::size_t offset : {0, 8}) {
      auto storage = std::make_unique<std::byte[]>(sizeof(QpProblem) + sizeof(QpSolution) + 256);
      const auto place = [offset](std::byte* p) {
        return p + (64 - reinterpret_cast<std::uintptr_t>(p) % 64) + offset;
      };
      const bool movable = alignof(QpProblem) <= 8 && alignof(QpSolution) <= 8;
      std::byte* at = movable ? place(storage.get()) : nullptr;
      auto local = std::make_unique<QpProblem>(c.problem);
      const QpProblem* problem = movable ? new (at) QpProblem(c.problem) : local.get();
      QpSolution again;
      fresh->solve(*problem, again);
      EXPECT_EQ(again.status, first.status);
      EXPECT_EQ(again.iterations, first.iterations);
      EXPECT_EQ(
          std::memcmp(again.power.data(), first.power.data(), sizeof(double) * first.power.size()),
          0);
      EXPECT_EQ(again.row_multiplier, first.row_multiplier);
      EXPECT_EQ(again.bound_multiplier, first.bound_multiplier);
      fresh->solve(large_case(random, 7, 9).problem, again);
    }
  }
}

TYPED_TEST(QpExam, DoesNotAllocate) {
  Random random(10);
  Case planted = small_case();
  planted.problem.hessian(0, 0) = kNan;
  Case infeasible = small_case();
  infeasible.problem.limit(0) = -1;
  const Case cases[] = {large_case(random, kMaxInputs, kMaxInputs), small_case(), infeasible,
                        planted, large_case(random, 20, 0)};
  TypeParam first;
  QpSolution solution;
  if (!this->kExact) GTEST_SKIP() << "allocates for sizes it has not seen: tests/osqp";
  const photocoag::testing::HeapGuard guard;
  for (const Case& c : cases) first.solve(c.problem, solution);
  EXPECT_EQ(guard.use(), photocoag::testing::HeapUse{});
}

}  // namespace
}  // namespace photocoag::qp_exam
