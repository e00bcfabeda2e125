// Role: online; a controller whose samples are means over the pulses of a period, each taken just
// before the pulse's own heat. Used by run. Source: docs/photoacoustics.md (P9), (P10). Units: SI.
// Real time: observe is noexcept, bounded, allocation-free.
#pragma once

#include <cmath>

#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/innovation.hpp"

namespace photocoag {

/// How far the temperature at the end of a period is ahead of what its pulses show:
///   C (of_state x + of_input B u), x at the start of the period.
struct PulseSampling {
  StateMatrix of_state;
  StateMatrix of_input;
};

/// Adds to each sample what the model says it lags behind, then is a BasicController: the
/// innovation is exactly that of the averaged sample.
template <PredictiveController M>
class PulsedController {
 public:
  PulsedController(const ReducedModel& model, const ControlSettings& control,
                   const EstimatorSettings& estimator, const PulseSampling& sampling)
      : inside_(model, control, estimator), sampling_(sampling) {}

  Estimate observe(const Sample& sample) noexcept PHOTOCOAG_NONBLOCKING {
    const double power = std::isfinite(sample.applied_power) ? sample.applied_power : power_;
    power_ = power;
    const auto& filter = inside_.filter();
    const StateVector lag = sampling_.of_state * filter.state() +
                            sampling_.of_input * (filter.matrices().input * power);
    return inside_.observe(
        {.volume_temperature = sample.volume_temperature + filter.matrices().volume.dot(lag),
         .applied_power = sample.applied_power});
  }
  Decision decide() noexcept PHOTOCOAG_NONBLOCKING {
    const Decision decision = inside_.decide();
    power_ = decision.power;
    return decision;
  }
  Decision step(const Sample& sample) noexcept PHOTOCOAG_NONBLOCKING {
    observe(sample);
    return decide();
  }
  Estimate estimate() const noexcept { return inside_.estimate(); }
  const BasicController<M>& inside() const noexcept { return inside_; }

 private:
  BasicController<M> inside_;
  PulseSampling sampling_;
  double power_ = 0.0;
};

template <PredictiveController M>
Innovation innovation_of(const PulsedController<M>& controller) noexcept {
  return innovation_of(controller.inside());
}

}  // namespace photocoag
