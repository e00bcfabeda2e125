// Role: online; one step of the paper's Algorithm 1: estimate, reference power, solve, gate. Used
// by loop, run, export, fmu, python and programs that embed the controller (examples/embed).
// Source: paper, Algorithm 1; docs/equations.md (E14) to (E23). Units: SI. Real time: observe,
// decide and step are noexcept, bounded and allocation-free from the first call. Threads: one
// owner.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/real_time.hpp"
#include "photocoag/estimation/estimator.hpp"
#include "photocoag/loop/gate.hpp"
#include "photocoag/mpc/chance.hpp"
#include "photocoag/mpc/mpc.hpp"
#include "photocoag/mpc/robust.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag {

/// Measurement at the end of a period.
struct Sample {
  double volume_temperature = std::numeric_limits<double>::quiet_NaN();  ///< K; NaN: missing
  double applied_power = 0.0;  ///< W (commanded scale), emitted during the period
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
  /// W, the plan's next two powers after this one; NaN: nothing planned.
  std::array<double, 2> plan{std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};
};

/// `Mpc` is constructed from (model, control); `Filter` from (model, estimator), or passed in.
template <PredictiveController Mpc, Estimator Filter = AnyEstimator>
class BasicController {
 public:
  /// Throws Error on bad settings or a model for another period.
  BasicController(const ReducedModel& model, const ControlSettings& control,
                  const EstimatorSettings& estimator)
      : BasicController(model, control, estimator, Filter(model, estimator)) {}
  BasicController(const ReducedModel& model, const ControlSettings& control,
                  const EstimatorSettings& estimator, Filter filter)
      : filter_(std::move(filter)),
        mpc_(control_model(model), control),
        transition_(control_model(model).A_d),
        delay_(control.delay),
        solve_every_(control.solve_every),
        planned_stages_(control.horizon - 1),
        power_max_(control.power_max),
        first_power_(control.first_power) {
    if (control.robust == Robustness::kCertified) {
      robust_.emplace(model, control,
                      AbsorptionFactors(estimator.absorption_max, estimator.choroid_max));
    }
    if (control.robust == Robustness::kChance) {
      if (posterior() == nullptr) {
        throw Error(ErrorParts{.key = "control.robust",
                               .problem = "a limit with probability needs a posterior estimate",
                               .found = "\"chance\"",
                               .accepted = "\"none\", or estimator.kind = \"posterior\""});
      }
      chance_.emplace(posterior()->model(), control);
    }
    powers_.setZero(planned_stages_);
    identification_ = {std::llround(control.identification_duration / control.period),
                       control.identification_power, control.identification_sigma};
    state_ = filter_.state();
  }

  /// Processes the sample at the end of a period. Without a finite sample the estimator only
  /// predicts; a reported power that is not finite is replaced by the command.
  Estimate observe(const Sample& sample) noexcept PHOTOCOAG_NONBLOCKING {
    return estimate(take_in(sample));
  }

  /// The power of the next period, after the gate. The first may be fixed (control.first_power):
  /// the paper's experiments begin with a step of 20 mW that gives the first sample.
  Decision decide() noexcept PHOTOCOAG_NONBLOCKING {
    const int stage = static_cast<int>(decisions_ % solve_every_);
    if (stage == 0) {
      last_ = solve();
    } else if constexpr (requires { mpc_.planned(stage); }) {
      last_.power = last_.status == MpcStatus::kSolved || last_.status == MpcStatus::kRelaxed
                        ? mpc_.planned(stage)
                        : 0.0;
    }
    if (decisions_ == 0 && first_power_ > 0.0) last_.power = first_power_;
    if (identifying()) last_.power = std::min(last_.power, identification_.power);
    ++decisions_;
    const GateResult passed = gate(last_.power, power_max_);
    previous_power_ = passed.power;
    pending_power_ = passed.power;
    return {.power = passed.power,
            .power_reference = last_.power_reference,
            .status = last_.status,
            .gate = passed.verdict,
            .iterations = stage == 0 ? last_.iterations : 0,
            .limit_active = last_.limit_active,
            .plan = {planned(stage + 1), planned(stage + 2)}};
  }

  /// observe and decide: sample in, power out.
  Decision step(const Sample& sample) noexcept PHOTOCOAG_NONBLOCKING {
    take_in(sample);
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

  const Filter& filter() const noexcept { return filter_; }

 private:
  UpdateStatus take_in(const Sample& sample) noexcept {
    const double power =
        std::isfinite(sample.applied_power) ? sample.applied_power : previous_power_;
    previous_power_ = power;
    ++cycle_;  // periods, not solves: a period that the controller missed counts
    filter_.predict(power);
    if (robust_) robust_->observe(power);
    return filter_.update(sample.volume_temperature);
  }

  // Identification phase: for a fixed time, or until the next peak is known well enough.
  struct Identification {
    long long cycles = 0;
    double power = 0.0;  // W
    double sigma = 0.0;  // K at the reference; 0: by time alone
  };

  bool identifying() noexcept {
    if (decisions_ >= identification_.cycles) return false;
    const bool known =
        chance_ && decisions_ > 0 &&
        chance_->relative_sigma() * mpc_.ocp().settings().peak_reference < identification_.sigma;
    if (known) identification_.cycles = 0;  // for good
    return !known;
  }

  double planned(int stage) const noexcept {
    if constexpr (requires { mpc_.planned(stage); }) {
      if (stage < planned_stages_) return mpc_.planned(stage);
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  // u_prev: the power in the period before the plan's first one. The first decision has none and
  // takes u_ref (paper), delayed or not.
  double previous_power(const StateVector& input) const noexcept {
    if (decisions_ == 0) return mpc_.ocp().steady_power(input, cycle_ + delay_);
    return delay_ == 1 ? pending_power_ : previous_power_;
  }

  // From the state at which the new power begins to act: with a delay of one period that is the end
  // of the period that the power decided last is about to heat.
  MpcResult solve() noexcept PHOTOCOAG_NONBLOCKING {
    const StateVector& input = filter_.matrices().input;
    state_ = filter_.state();
    if (delay_ == 1) state_ = (transition_ * state_ + input * pending_power_).eval();
    const double previous = previous_power(input);
    if constexpr (requires(const LimitTightening* t) {
                    mpc_.solve(state_, input, cycle_, previous, t);
                    mpc_.planned(0);
                  }) {
      if (chance_) return solve_by_chance(input, previous);
      if (robust_) {
        return mpc_.solve(state_, input, cycle_ + delay_, previous,
                          &robust_->tighten(filter_.covariance(),
                                            {.alpha = filter_.absorption_factor(),
                                             .alpha_sigma = filter_.absorption_sigma(),
                                             .beta = filter_.choroid_factor(),
                                             .beta_sigma = filter_.choroid_sigma()},
                                            delay_ == 1, delay_ == 1 ? pending_power_ : 0.0));
      }
    }
    return mpc_.solve(state_, input, cycle_ + delay_, previous);
  }

  // A peak's uncertainty depends slightly on the powers that lead to it: solve around the last
  // plan, then around each new one, until the limit no longer changes.
  MpcResult solve_by_chance(const StateVector& input,
                            double previous) noexcept PHOTOCOAG_NONBLOCKING {
    constexpr int kMostSolves = 4;
    constexpr double kSame = 1e-3;  // K
    const PosteriorEstimator& known = *posterior();
    modes_ = known.modes();
    if (delay_ == 1) modes_ = known.after(modes_, pending_power_);
    const auto last = planned_stages_ - 1;
    for (int k = 0; k <= last; ++k) powers_[k] = powers_[std::min(k + solve_every_, last)];
    if (decisions_ == 0 || !powers_.allFinite()) powers_.setConstant(previous);
    MpcResult result;
    for (int i = 0; i < kMostSolves; ++i) {
      const LimitTightening& limit = chance_->tighten({.modes = modes_,
                                                       .peak_residue = known.peak_residue(),
                                                       .peak_slope = known.peak_slope(),
                                                       .covariance = known.covariance_of_logs()},
                                                      input, powers_);
      if (i > 0 && chance_->change() <= kSame) break;
      result = mpc_.solve(state_, input, cycle_ + delay_, previous, &limit);
      for (int k = 0; k <= last; ++k) powers_[k] = mpc_.planned(k);
    }
    return result;
  }

  // The filter's posterior, which a chance constraint needs; null without one.
  const PosteriorEstimator* posterior() const noexcept {
    if constexpr (requires { filter_.posterior(); }) return filter_.posterior();
    return nullptr;
  }

  // The posterior's modes have a control problem of their own.
  ReducedModel control_model(const ReducedModel& model) const {
    return posterior() == nullptr ? model : posterior()->model().control_model();
  }

  Filter filter_;
  Mpc mpc_;
  std::optional<RobustLimit> robust_;
  std::optional<ChanceLimit> chance_;
  InputVector powers_;  // linearization point of the chance constraint
  StateVector modes_;
  Identification identification_;
  StateMatrix transition_;
  StateVector state_;
  int delay_;
  int solve_every_;
  int planned_stages_;
  double power_max_;
  double first_power_;
  double previous_power_ = 0.0;  // applied
  double pending_power_ = 0.0;   // decided last
  long long cycle_ = 0;
  long long decisions_ = 0;
  MpcResult last_;
};

/// The default: the exact solver.
using Controller = BasicController<ModelPredictiveController<DenseSolver>>;

}  // namespace photocoag
