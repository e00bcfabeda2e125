// Role: safety tests; a controller with injected faults. Used by fault_table. Independent of the
// supervisor. Real time: noexcept, no allocation after construction.
#pragma once

#include "photocoag/faults/faulty_device.hpp"
#include "photocoag/faults/injection.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/innovation.hpp"
#include "photocoag/loop/simulated_eye.hpp"

namespace photocoag {

class FaultyController {
 public:
  FaultyController(const Controller& controller, const Injection& injection, TrialRecord& trial)
      : controller_(controller), fresh_(controller), injection_(injection), trial_(trial) {}

  Estimate observe(const Sample& sample) noexcept {
    ++cycle_;
    estimate_ = controller_.observe(sample);
    if (!active()) return estimate_;
    switch (injection_.fault) {
      case Fault::kRestart:
        controller_ = fresh_;
        estimate_ = controller_.estimate(UpdateStatus::kRestarted);
        see();
        break;
      case Fault::kAbsorption:
        estimate_.absorption_factor = injection_.value;
        see();
        break;
      case Fault::kPeakEstimate:
        estimate_.outputs.peak = injection_.value;
        see();
        break;
      case Fault::kInnovation:
        see();
        break;
      default:
        break;
    }
    return estimate_;
  }

  Decision decide() noexcept {
    Decision decision = controller_.decide();
    if (!active()) return decision;
    switch (injection_.fault) {
      case Fault::kInfeasible:
        decision.status = MpcStatus::kRelaxed;
        decision.power = injection_.value;
        see();
        break;
      case Fault::kSolverFails:
        decision.status = MpcStatus::kFailed;
        decision.power = injection_.value;
        see();
        break;
      case Fault::kCommand:
        decision.power = injection_.value;
        see();
        break;
      case Fault::kAbsorption:
      case Fault::kPeakEstimate:
        decision.power = full_power_;
        break;
      case Fault::kStuckOn:
        decision.power = 0.0;
        break;
      default:
        break;
    }
    return decision;
  }

  Estimate estimate() const noexcept { return controller_.estimate(); }
  const Controller& inside() const noexcept { return controller_; }

  friend Innovation innovation_of(const FaultyController& faulty) noexcept {
    Innovation innovation = innovation_of(faulty.controller_);
    if (faulty.active() && faulty.injection_.fault == Fault::kInnovation) {
      innovation.value *= faulty.injection_.value;
    }
    return innovation;
  }

 private:
  bool active() const noexcept {
    return cycle_ >= 0 && injection_.active(static_cast<std::uint64_t>(cycle_));
  }
  void see() noexcept {
    if (trial_.visible == TrialRecord::kNever) trial_.visible = cycle_;
  }

  Controller controller_;
  Controller fresh_;
  Injection injection_;
  TrialRecord& trial_;
  Estimate estimate_;
  double full_power_ = 0.1;  // W
  std::int64_t cycle_ = -1;
};

/// A clock in virtual time that wakes the loop late where the injection says so.
class LatePace : public VirtualPace {
 public:
  LatePace(double period, const Injection& injection, TrialRecord& trial)
      : VirtualPace(period), injection_(injection), trial_(trial) {}
  std::size_t wait_for_end_of(std::size_t cycle) noexcept {
    const bool first = cycle == injection_.start;
    const bool second = cycle == injection_.start + injection_.every;
    if (injection_.fault == Fault::kOverrun && first) {
      // Detectable only once the loop wakes: at the last of the missed periods.
      trial_.visible = static_cast<std::int64_t>(cycle + injection_.count);
      return static_cast<std::size_t>(injection_.count);
    }
    if (injection_.fault == Fault::kTwoOverruns && (first || second)) {
      trial_.visible = static_cast<std::int64_t>(cycle + 1);
      return 1;
    }
    return 0;
  }

 private:
  Injection injection_;
  TrialRecord& trial_;
};

}  // namespace photocoag
