// The exam examined: solvers with a planted fault must not pass.
#include <gtest/gtest.h>

#include <algorithm>

#include "photocoag/qp/dense.hpp"
#include "qp/exam.hpp"

namespace photocoag {

struct DenseSolverProbe {
  static const InputVector& iterate(const DenseSolver& solver) { return solver.u_; }
};

}  // namespace photocoag

namespace photocoag::qp_exam {
namespace {

constexpr Tolerances kTolerances{
    .power = 1e-12, .stationarity = 1e-13, .feasibility = 2e-13, .infeasibility = 1e-9};

void clip(const QpProblem& qp, InputVector& u) { u = u.cwiseMax(qp.lower).cwiseMin(qp.upper); }

// Every mutant keeps u in the box and calls itself solved where it can: only optimality tells.
struct Faithful {
  DenseSolver solver;
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept { return solver.solve(qp, s); }
};

struct DropsAnUpperBound : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    QpProblem changed = qp;
    const int last = int(qp.upper.size()) - 1;
    if (qp.upper(last) >= qp.lower(last)) changed.upper(last) += 10;
    solver.solve(changed, s);
    clip(qp, s.power);
    return s.status;
  }
};

struct DropsTheLastRow : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    QpProblem changed = qp;
    if (qp.limit.size() > 0)
      changed.limit(qp.limit.size() - 1) = std::numeric_limits<double>::infinity();
    return solver.solve(changed, s);
  }
};

struct TakesTheGradientWithTheWrongSign : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    QpProblem changed = qp;
    changed.gradient *= -1;
    return solver.solve(changed, s);
  }
};

struct CallsInfeasibleSolved : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    if (solver.solve(qp, s) == QpStatus::kInfeasible) s.status = QpStatus::kSolved;
    return s.status;
  }
};

struct CallsTightProblemsInfeasible : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    QpProblem changed = qp;
    for (int i = 0; i < qp.limit.size(); ++i) changed.limit(i) -= 1e-5 * double(row_scale(qp, i));
    if (solver.solve(changed, s) == QpStatus::kInfeasible) return s.status;
    return solver.solve(qp, s);
  }
};

struct StopsOneIterationEarly : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    if (solver.solve(qp, s) != QpStatus::kSolved || s.iterations == 0) return s.status;
    DenseSolver early(s.iterations - 1);
    QpSolution ignored;
    early.solve(qp, ignored);
    s.power = DenseSolverProbe::iterate(early);  // with the multipliers of the solution
    clip(qp, s.power);
    return s.status;
  }
};

struct PerturbsTheAnswer : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    if (solver.solve(qp, s) != QpStatus::kSolved) return s.status;
    s.power(0) += s.power(0) > qp.lower(0) ? -1e-6 : 1e-6;
    clip(qp, s.power);
    return s.status;
  }
};

struct ForgetsAMultiplier : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    solver.solve(qp, s);
    s.bound_multiplier.setZero();
    return s.status;
  }
};

struct LeavesTheBox : Faithful {
  QpStatus solve(const QpProblem& qp, QpSolution& s) noexcept {
    solver.solve(qp, s);
    if (s.status != QpStatus::kSolved) s.power.setConstant(2143289344.0);  // OSQP's "not a number"
    return s.status;
  }
};

// Number of cases of the exam that the solver does not pass.
template <QpSolver Solver>
int faults() {
  Solver solver;
  QpSolution solution;
  int count = 0;
  for_each_exam_case(kTolerances, [&](const Case& c) {
    const QpStatus status = solver.solve(c.problem, solution);
    if (!judge(c, status, solution, kTolerances).empty()) ++count;
  });
  return count;
}

TEST(Exam, PassesTheFaithfulSolver) { EXPECT_EQ(faults<Faithful>(), 0); }

template <typename Solver>
class Mutant : public testing::Test {};
using Mutants =
    testing::Types<DropsAnUpperBound, DropsTheLastRow, TakesTheGradientWithTheWrongSign,
                   CallsInfeasibleSolved, CallsTightProblemsInfeasible, StopsOneIterationEarly,
                   PerturbsTheAnswer, ForgetsAMultiplier, LeavesTheBox>;
TYPED_TEST_SUITE(Mutant, Mutants);

TYPED_TEST(Mutant, FailsTheExam) {
  const int count = faults<TypeParam>();
  this->RecordProperty("faults_found", count);
  EXPECT_GT(count, 10);  // not by a single lucky case
}

}  // namespace
}  // namespace photocoag::qp_exam
