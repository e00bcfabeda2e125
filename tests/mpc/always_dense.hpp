// Role: tests of the plans where nothing binds; a solver to hold them against.
#pragma once

#include "photocoag/qp/dense.hpp"

namespace photocoag::testing {

/// `dense` under another name: is asked in every cycle.
struct AlwaysDense {
  DenseSolver solver;
  QpStatus solve(const QpProblem& problem, QpSolution& solution) noexcept {
    return solver.solve(problem, solution);
  }
};

}  // namespace photocoag::testing
