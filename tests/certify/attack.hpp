// Role: tests; an attack on the proved number of active-set changes that shares nothing with the
// search but the solver: states of the reduced model, condensed by mpc/ocp, solved by DenseSolver.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "photocoag/certify/parameter_box.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mpc/ocp.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag::testing {

inline CertifiedBox box_of(double low, double high) {
  CertifiedBox box;
  box.free.fill({low, high});
  return box;
}

/// Problems of a box, some with every number at an end of its range, at the limit or at the
/// reference.
class Attack {
 public:
  Attack(const ReducedModel& model, const ControlSettings& settings, const CertifiedBox& box)
      : model_(model), settings_(settings), box_(box), ocp_(model, settings), random_(7) {
    const int order = model.order();
    Eigen::MatrixXd rows(order, order);
    StateVector row = model.C_peak;
    for (int k = 0; k < order; ++k) {
      row = (row.transpose() * model.A_d).transpose().eval();
      rows.row(k) = row.transpose();
    }
    observed_ = rows.transpose();
  }

  /// The most changes in so many problems.
  int most(int problems) {
    int largest = 0;
    for (int i = 0; i < problems; ++i) largest = std::max(largest, changes());
    EXPECT_GT(used_, problems / 3);
    return largest;
  }

 private:
  double draw(const BoxRange& range) {
    const double share = std::uniform_real_distribution<>(-0.1, 1.1)(random_);
    return range.low + std::clamp(share, 0.0, 1.0) * (range.high - range.low);
  }

  int changes() {
    const int n = settings_.horizon - 1;
    Eigen::VectorXd free = Eigen::VectorXd::Zero(model_.order());
    for (int k = 0; k < n; ++k) {
      free[k] = draw(box_.free[k]);
      const int corner = std::uniform_int_distribution<>(0, 9)(random_);
      if (corner == 0) free[k] = settings_.peak_max;
      if (corner == 1) free[k] = settings_.peak_reference;
    }
    const StateVector state(solve_transposed(observed_, free));
    model_.evaluate({draw(box_.absorption), draw(box_.choroid)}, matrices_);
    const double reference = ocp_.steady_power(matrices_.input);
    const bool first = std::uniform_int_distribution<>(0, 9)(random_) == 0;
    ocp_.condense({.state = state,
                   .input = matrices_.input,
                   .cycle = 3,
                   .power_reference = reference,
                   .previous_power = first ? reference : draw(box_.previous)},
                  problem_);
    for (int k = 0; k < n; ++k) {  // what the state came to
      if (!(ocp_.free_response(k + 1) >= box_.free[k].low)) return 0;
      if (!(ocp_.free_response(k + 1) <= box_.free[k].high)) return 0;
    }
    ++used_;
    solver_.solve(problem_, solution_);
    return solution_.iterations;
  }

  const ReducedModel& model_;
  const ControlSettings& settings_;
  const CertifiedBox& box_;
  OptimalControlProblem ocp_;
  Eigen::MatrixXd observed_;
  std::mt19937 random_;
  ParametricMatrices matrices_;
  DenseSolver solver_;
  QpProblem problem_;
  QpSolution solution_;
  int used_ = 0;
};

}  // namespace photocoag::testing
