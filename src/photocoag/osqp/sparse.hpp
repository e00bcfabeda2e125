// Role: online, by choice (`control.solver = "osqp"`); as in the paper: OSQP on the sparse optimal
// control problem, with states and inputs as variables. Used by run, study, python and the
// benchmark.
// Source: paper, section 3 and Algorithm 1: updates in place, warm start; docs/control.md.
// Differences: u is scaled by u_max; the states are each state's share of the peak temperature, K,
// in balanced coordinates, so that OSQP's tolerances do not depend on the reduced model's basis; no
// bound at stage 0, which no input can change; the limit is relaxed as in ocp.hpp; OSQP is set up
// and run before the treatment, so that the first cycle starts warm (the paper leaves that to
// future work); the powers are polished and checked on the condensed problem (E20), as every
// solver's, and OSQP goes on with a finer tolerance where they fail. Units: SI outside. Real time:
// as workspace.hpp after construction.
#pragma once

#include "photocoag/mpc/mpc.hpp"
#include "photocoag/osqp/condensed.hpp"
#include "photocoag/osqp/workspace.hpp"

namespace photocoag {

enum class SparseForm {
  kPrepared,  ///< shares of the peak as states, the cold eye solved before the treatment
  // For comparison (`bench qp`); powers are accepted by OSQP's own criterion, unchecked:
  kOwnCriterion,  ///< as kPrepared
  kUnprepared,    ///< no solve before the treatment: the paper's settings
  kModelStates,   ///< as kUnprepared, with the reduced model's own states
};

class SparseOsqpController {
 public:
  /// Throws Error on bad settings or a model for another period.
  SparseOsqpController(const ReducedModel& model, const ControlSettings& settings,
                       SparseForm form = SparseForm::kPrepared);

  /// As ModelPredictiveController::solve; OSQP starts at settings.osqp_tolerance.
  MpcResult solve(const StateVector& state, const StateVector& input, long long cycle,
                  double previous_power) noexcept;

  const OptimalControlProblem& ocp() const noexcept { return ocp_; }

 private:
  void set_up();
  void fill(const StateVector& state, const StateVector& input, long long cycle, double reference,
            double previous) noexcept;
  bool read() noexcept;

  SparseForm form_;
  OptimalControlProblem ocp_;
  Eigen::MatrixXd to_shares_;  // z = to_shares x
  Eigen::MatrixXd A_;          // of z
  Eigen::VectorXd output_;     // peak = output' z
  StateVector share_;          // scratch
  OsqpWorkspace workspace_;
  QpProblem problem_;    // condensed
  QpSolution solution_;  // of the last cycle
  Polisher polisher_;
  bool new_weights_ = false;
  std::vector<std::size_t> input_entries_;  // of B in A.value, stage by stage
  std::vector<std::size_t> state_entries_;  // of 2 R0 c c' in P.value, stages 1 … N-1
  InputVector weights_;                     // R0 in P now
};

/// OSQP on the condensed problem, prepared and run once before the treatment.
class CondensedOsqpController : public ModelPredictiveController<CondensedOsqp> {
 public:
  CondensedOsqpController(const ReducedModel& model, const ControlSettings& settings);
};

}  // namespace photocoag
