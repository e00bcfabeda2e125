// Role: tests; the exam that every solver of QpProblem sits: problems, what must come out, the
// judge. The judge evaluates in long double and believes nothing that the solver says about itself.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "photocoag/qp/problem.hpp"
#include "qp/oracle.hpp"

namespace photocoag::qp_exam {

/// What a solver promises; each solver sits the exam with its own.
struct Tolerances {
  double power;          ///< |u - oracle's u| over the box, for a condition number of 1e3 or less
  double stationarity;   ///< |H u + g + G' l + m| over the terms that cancel
  double feasibility;    ///< row violation over the row's scale, feasible problems
  double infeasibility;  ///< relaxed by this much of a row's scale and still infeasible: must be
                         ///< noticed
  double thin = 0.0;  ///< a problem that is infeasible once tightened by this much of a row's scale
                      ///< may be called infeasible
  bool may_give_up = false;  ///< kIterationLimit or kKktFailed, with the safe u, is an answer
                             ///< (counted by the test)
};

enum class Expected {
  kSolved,
  kInfeasible,
  kEither,   ///< infeasible by less than the solver must notice: no demand, but no wrong answer
  kFailure,  ///< bad data
};

struct Case {
  std::string name;
  QpProblem problem = {};
  Expected expected = Expected::kSolved;
  std::vector<Real> power = {};  ///< the minimizer, if known
  double condition = 1.0;        ///< of H; errors in u grow with it
};

/// Uniform numbers with the same bits on every platform (std distributions differ).
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * double(engine_() >> 11) * 0x1p-53;
  }
  int integer(int low, int high) { return low + int(engine_() % std::uint64_t(high - low + 1)); }
  bool chance(double p) { return uniform(0, 1) < p; }

 private:
  std::mt19937_64 engine_;
};

/// The complaint about a solver's answer; empty if there is none.
std::string judge(const Case& c, QpStatus returned, const QpSolution& s, const Tolerances& tol);

/// Fills in expected and power by the oracle.
void consult_oracle(Case& c, const Tolerances& tol);

// Families of problems. Those marked (oracle) know the minimizer.
Case random_case(Random& random, int inputs, int rows);       ///< any active set, many infeasible
Case degenerate_case(Random& random);                         ///< small integers: ties everywhere
Case nearly_infeasible_case(Random& random, double gap);      ///< gap < 0: infeasible by -gap
Case ill_conditioned_case(Random& random, double condition);  ///< no oracle needed: judged by KKT
Case large_case(Random& random, int inputs, int rows);        ///< feasible, strongly constrained
QpProblem with_row_scaled(QpProblem qp, int row, double factor);
QpProblem with_objective_scaled(QpProblem qp, double factor);

/// A closed loop: the problems that model predictive control of a laser spot meets.
struct Application {
  int horizon = 5;           ///< N; n = m = N - 1
  double power_weight = 0;   ///< R1, K2 per squared full power
  double change_weight = 0;  ///< R2, the same
  bool delayed = false;      ///< R0 = 0 for the cycles 1 to 3
  int cycles = 300;
  double disturbance_K = 0.3;  ///< uniform error of the estimate in every cycle
};
/// Calls visit(case) in every cycle; visit returns the first power, which is then applied.
void run_application(const Application& a, std::uint64_t seed,
                     const std::function<double(const Case&)>& visit);

/// Everything a broken solver has to get past; calls visit on each case (with the oracle
/// consulted).
void for_each_exam_case(const Tolerances& tol, const std::function<void(const Case&)>& visit);

}  // namespace photocoag::qp_exam
