// Role: offline; individual problems from a box of parameters, solved by DenseSolver. Used by
// certify to find the largest observed number of changes. Source: (E20), written out (condensing is
// mpc/ocp).
// Units: SI. Real time: none. Threads: one owner.
#pragma once

#include <array>

#include "photocoag/certify/parameter_box.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag {

/// One point of a box.
struct ParameterPoint {
  double absorption = 1.0;
  double choroid = 1.0;
  std::array<double, kMaxStages> free{};  // K
  double previous = 0.0;                  // W
};

class SampledProblem {
 public:
  SampledProblem(const ReducedModel& model, const ControlSettings& settings, long long cycle);

  /// The problem at a point, as OptimalControlProblem condenses it up to rounding.
  const QpProblem& at(const ParameterPoint& point);
  /// Changes of the active set that DenseSolver makes for it.
  int changes(const ParameterPoint& point);

 private:
  const ReducedModel& model_;
  const ControlSettings& settings_;
  long long cycle_;
  std::array<StateVector, kMaxStages> rows_;  // C A^i
  StateVector steady_row_;
  ParametricMatrices matrices_;
  DenseSolver solver_;
  QpProblem problem_;
  QpSolution solution_;
};

}  // namespace photocoag
