// Arrhenius damage against the isothermal thresholds that the published parameters imply, and its
// integration.
#include "photocoag/tissue/thermal_dose.hpp"

#include <gtest/gtest.h>

namespace photocoag {
namespace {

struct Threshold {
  int set;
  double seconds;
  double celsius;  // damage 1 after so long at this temperature
};

// Temperatures to 0.1 K, as tabulated from the published A and E_a; 0.05 K is their rounding.
TEST(ThermalDose, IsothermalThresholdsAreThePublishedOnes) {
  for (const Threshold& t :
       {Threshold{0, 0.02, 60.2}, Threshold{0, 0.1, 54.8}, Threshold{0, 0.4, 50.4},
        Threshold{1, 0.02, 62.3}, Threshold{1, 0.1, 59.9}, Threshold{1, 0.4, 57.9}}) {
    EXPECT_LT(t.seconds * damage_rate(kPublishedDamage[t.set], t.celsius - 0.06), 1.0) << t.celsius;
    EXPECT_GT(t.seconds * damage_rate(kPublishedDamage[t.set], t.celsius + 0.06), 1.0) << t.celsius;
  }
}

TEST(ThermalDose, IntegralOverARampAgreesWithFineSteps) {
  for (const ArrheniusParameters& tissue : kPublishedDamage) {
    double fine = 0.0;
    constexpr int kSteps = 3000;
    for (int i = 0; i < kSteps; ++i) {
      fine += damage_rate(tissue, 50.0 + 3.0 * (i + 0.5) / kSteps) * 1e-3 / kSteps;
    }
    EXPECT_NEAR(damage_over(tissue, 50.0, 53.0, 1e-3) / fine, 1.0, 0.01);
  }
}

TEST(ThermalDose, IsFiniteAndZeroWhereThereIsNoTemperature) {
  EXPECT_EQ(damage_rate(kPublishedDamage[0], -300.0), 0.0);
  EXPECT_EQ(damage_rate(kPublishedDamage[0], std::nan("")), 0.0);
  EXPECT_TRUE(std::isfinite(damage_rate(kPublishedDamage[1], 200.0)));
}

}  // namespace
}  // namespace photocoag
