#include "photocoag/safety/dose_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimation/test_models.hpp"
#include "photocoag/tissue/thermal_dose.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

struct Dose {
  SafetyLimits limits;
  SafetyLatch latch;
  MultiModelObserver observer{observer_for(model_1khz()), 0.288, 0.01};
  DoseCheck check;
  Dose() { latch.status.state = SafetyState::kTreating; }

  void period(double power, double on_its_way = 0.0) {
    observer.emit(power);
    check.account(power, power, on_its_way, observer, limits, latch);
  }
  /// Periods with `power` until it ends.
  int periods(double power, double on_its_way = 0.0) {
    for (int k = 1; k <= 1000; ++k) {
      period(power, on_its_way);
      if (latch.status.state != SafetyState::kTreating) return k;
    }
    return 0;
  }
};

TEST(DoseCheck, EnergyEndsOnePeriodBeforeItsLimit) {
  Dose d;
  d.limits.energy_max = 1e-3 + 1e-9;  // fifty periods of 20 uJ
  EXPECT_EQ(d.periods(0.02), 50);
  EXPECT_EQ(d.latch.status.reason, SafetyReason::kEnergy);
  EXPECT_NEAR(d.latch.status.energy, 1e-3, 1e-12);
  Dose inaccurate;
  inaccurate.limits.energy_max = 1e-3 + 1e-9;
  inaccurate.limits.power_accuracy = 0.25;
  EXPECT_EQ(inaccurate.periods(0.02), 40) << "what the readback may hide counts";
  Dose delayed;
  delayed.limits.energy_max = 1e-3 + 1e-9;
  EXPECT_EQ(delayed.periods(0.02, 20e-6), 49) << "one more is on its way";
}

TEST(DoseCheck, OnlyTimeWithLightCounts) {
  Dose d;
  d.limits.exposure_max = 0.05;
  for (int k = 0; k < 500; ++k) d.period(0.0);
  EXPECT_EQ(d.latch.status.exposure, 0.0);
  EXPECT_EQ(d.periods(0.001), 50);
  EXPECT_EQ(d.latch.status.reason, SafetyReason::kExposure);
}

TEST(DoseCheck, TheDoseIsThatOfTheHottestPlausiblePeak) {
  Dose d;
  d.limits.ambient_celsius = 37.0;
  d.limits.dose_max = 1e9;
  d.limits.dose_log_frequency = std::log(3e44);
  d.limits.dose_activation_energy = 273e3;
  const ArrheniusParameters tissue{.name = {},
                                   .end_point = {},
                                   .log_frequency = d.limits.dose_log_frequency,
                                   .activation_energy = d.limits.dose_activation_energy};
  double expected = 0.0;
  double before = 0.0;
  for (int k = 0; k < 40; ++k) {
    d.period(0.02);
    const double peak = d.observer.peak_high();
    expected += damage_over(tissue, 37.0 + before, 37.0 + peak, d.limits.period);
    before = peak;
  }
  EXPECT_GT(expected, 0.0);
  EXPECT_DOUBLE_EQ(d.latch.status.dose, expected);
  d.limits.dose_max = expected;
  EXPECT_EQ(d.periods(0.02), 1);
  EXPECT_EQ(d.latch.status.reason, SafetyReason::kThermalDose);
}

TEST(DoseCheck, ThePowerLeftSpendsWhatIsLeft) {
  SafetyStatus status;
  SafetyLimits limits;
  limits.energy_max = 1e-3;
  status.energy = 0.9e-3;
  EXPECT_NEAR(DoseCheck::power_left(status, 0.0, limits), 0.1, 1e-12);
  EXPECT_NEAR(DoseCheck::power_left(status, 0.04e-3, limits), 0.06, 1e-12);
  limits.power_accuracy = 1.0;
  EXPECT_NEAR(DoseCheck::power_left(status, 0.0, limits), 0.05, 1e-12);
}

}  // namespace
}  // namespace photocoag::testing
