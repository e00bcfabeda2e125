#include "photocoag/safety/dose_check.hpp"

#include "photocoag/tissue/thermal_dose.hpp"

namespace photocoag {

void DoseCheck::account(double power, double written, double on_its_way,
                        const MultiModelObserver& observer, const SafetyLimits& limits,
                        SafetyLatch& latch) noexcept {
  SafetyStatus& status = latch.status;
  status.energy += power * (1.0 + limits.power_accuracy) * limits.period;
  if (power > 0.0) status.exposure += limits.period;
  if (limits.dose_max > 0.0) {
    const ArrheniusParameters tissue{.name = {},
                                     .end_point = {},
                                     .log_frequency = limits.dose_log_frequency,
                                     .activation_energy = limits.dose_activation_energy};
    const double peak = limits.hidden_gain() * observer.peak_high();
    status.dose += damage_over(tissue, limits.ambient_celsius + peak_before_,
                               limits.ambient_celsius + peak, limits.period);
    peak_before_ = peak;
  }
  if (status.state != SafetyState::kTreating) return;
  if (status.energy + on_its_way + written * (1.0 + limits.power_accuracy) * limits.period >
      limits.energy_max) {
    latch.stop(SafetyState::kDone, SafetyReason::kEnergy);
  }
  const double periods = on_its_way > 0.0 ? 1.5 : 0.5;
  if (status.exposure + periods * limits.period > limits.exposure_max) {
    latch.stop(SafetyState::kDone, SafetyReason::kExposure);
  }
  if (limits.dose_max > 0.0 && !(status.dose < limits.dose_max)) {
    latch.stop(SafetyState::kDone, SafetyReason::kThermalDose);
  }
}

double DoseCheck::power_left(const SafetyStatus& status, double on_its_way,
                             const SafetyLimits& limits) noexcept {
  return (limits.energy_max - status.energy - on_its_way) /
         (limits.period * (1.0 + limits.power_accuracy));
}

}  // namespace photocoag
