// Role: online; one step of the paper's Algorithm 1: estimate, reference power, solve, gate. Used
// by loop and by programs that embed the controller (examples/embed). Source: paper, Algorithm 1;
// docs/equations.md (E14) to (E23). Units: SI. Real time: observe, decide and step are noexcept,
// bounded and allocation-free from the first call. Threads: one owner.
#pragma once

#include <cmath>
#include <limits>

#include "photocoag/estimation/estimator.hpp"
#include "photocoag/loop/gate.hpp"
#include "photocoag/mpc/mpc.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag {

/// What was measured at the end of a period.
struct Sample {
  double volume_temperature = std::numeric_limits<double>::quiet_NaN();  ///< K; NaN: missing
  double applied_power = 0.0;  ///< W (commanded scale), what the laser emitted during the period
};

struct Estimate {
  Outputs outputs;          ///< K
  double peak_sigma = 0.0;  ///< K
  double absorption_factor = 0.0;
  double absorption_sigma = 0.0;
  double choroid_factor = 1.0;  ///< beta; a constant unless estimated
  double choroid_sigma = 0.0;
  UpdateStatus status = UpdateStatus::kNoSample;
};

struct Decision {
  double power = 0.0;            ///< W, passed by the gate
  double power_reference = 0.0;  ///< W, u_ref
  MpcStatus status = MpcStatus::kFailed;
  GateVerdict gate = GateVerdict::kPassed;
  int iterations = 0;
  bool limit_active = false;
};

class Controller {
 public:
  /// Throws Error on bad settings or a model for another period.
  Controller(const ReducedModel& model, const ControlSettings& control,
             const EstimatorSettings& estimator)
      : filter_(model, estimator), mpc_(model, control), power_max_(control.power_max) {}

  /// Takes in the sample at the end of a period. A sample that is not finite is a prediction only;
  /// a reported power that is not finite is replaced by the command.
  Estimate observe(const Sample& sample) noexcept {
    const double power =
        std::isfinite(sample.applied_power) ? sample.applied_power : previous_power_;
    previous_power_ = power;
    ++cycle_;  // periods, not solves: a period that the controller missed counts
    filter_.predict(power);
    const UpdateStatus status = filter_.update(sample.volume_temperature);
    return estimate(status);
  }

  /// The power of the coming period.
  Decision decide() noexcept {
    const MpcResult result =
        mpc_.solve(filter_.state(), filter_.matrices().input, cycle_, previous_power_);
    const GateResult passed = gate(result.power, power_max_);
    previous_power_ = passed.power;
    return {.power = passed.power,
            .power_reference = result.power_reference,
            .status = result.status,
            .gate = passed.verdict,
            .iterations = result.iterations,
            .limit_active = result.limit_active};
  }

  /// observe and decide: sample in, power out.
  Decision step(const Sample& sample) noexcept {
    observe(sample);
    return decide();
  }

  Estimate estimate(UpdateStatus status = UpdateStatus::kNoSample) const noexcept {
    return {.outputs = filter_.outputs(),
            .peak_sigma = filter_.peak_sigma(),
            .absorption_factor = filter_.absorption_factor(),
            .absorption_sigma = filter_.absorption_sigma(),
            .choroid_factor = filter_.choroid_factor(),
            .choroid_sigma = filter_.choroid_sigma(),
            .status = status};
  }

  const AnyEstimator& filter() const noexcept { return filter_; }

 private:
  AnyEstimator filter_;
  ModelPredictiveController<DenseSolver> mpc_;
  double power_max_;
  double previous_power_ = 0.0;
  long long cycle_ = 0;
};

}  // namespace photocoag
