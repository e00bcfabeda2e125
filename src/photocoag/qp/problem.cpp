#include "photocoag/qp/problem.hpp"

namespace photocoag {

void QpProblem::resize(int inputs, int constraints) noexcept {
  hessian.resize(inputs, inputs);
  gradient.resize(inputs);
  lower.resize(inputs);
  upper.resize(inputs);
  rows.resize(constraints, inputs);
  limit.resize(constraints);
}

std::string_view to_string(QpStatus status) noexcept {
  switch (status) {
    case QpStatus::kSolved:
      return "solved";
    case QpStatus::kInfeasible:
      return "infeasible";
    case QpStatus::kIterationLimit:
      return "iteration-limit";
    case QpStatus::kNumericalFailure:
      return "numerical-failure";
  }
  return "unknown";
}

}  // namespace photocoag
