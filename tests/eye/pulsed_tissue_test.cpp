// The tissue heated pulse by pulse, against the full-order model's exact steps.
#include "photocoag/eye/pulsed_tissue.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/fom/stepper.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "support/heap_guard.hpp"
#include "support/reduced_models.hpp"
#include "support/thrown.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {
namespace {

constexpr double kPulsePeriod = 1e-4;  // s
constexpr double kAlpha = 0.9;

CurveData bent() {
  return {.source = "a test",
          .coefficients = {0.05, 0.004, 6e-5},
          .temperatures = {},
          .values = {},
          .valid_from_celsius = 1.0,
          .valid_to_celsius = 150.0};
}

// Energy within 1 ns, then nothing: by the exact steps for constant power.
void slow_pulse(ModalStepper& stepper, double energy) {
  constexpr double kShort = 1e-9;
  stepper.set_period(kShort);
  stepper.step(energy / kShort);
}

TEST(PulsedTissue, EqualsAVeryShortConstantPower) {
  const auto model = coarse_full_model(normalized(Tissue{}));
  PulsedTissue tissue(model, kPulsePeriod, kAlpha, GrueneisenCurve(water_like_curve()));
  ModalStepper stepper(model, Discretization::kZeroOrderHold, kPulsePeriod, 0.0);
  const OutputWeights weights = model->output_weights(kAlpha);
  for (const double energy : {10e-6, 2e-6, 0.0, 5e-6, 0.0, 0.0}) {
    slow_pulse(stepper, energy);
    const double peak_after = stepper.outputs(weights).peak;
    // The mean over the period by 2000 midpoints, fine where the heat is fresh.
    constexpr int kParts = 2000;
    stepper.set_period(0.5 * kPulsePeriod / kParts);
    Outputs mean;
    for (int i = 0; i < kParts; ++i) {
      stepper.step(0.0);
      const Outputs now = stepper.outputs(weights);
      mean.peak += now.peak / kParts;
      mean.volume += now.volume / kParts;
      stepper.step(0.0);
    }
    tissue.pulse(energy);
    const Outputs exact = stepper.outputs(weights);
    // 1 ns of 100 us; modes gone within the period to 1e-6.
    EXPECT_NEAR(tissue.before().peak, exact.peak, 1e-4 * std::abs(exact.peak) + 1e-9);
    EXPECT_NEAR(tissue.before().volume, exact.volume, 1e-4 * exact.volume + 1e-9);
    EXPECT_NEAR(tissue.peak_after(), peak_after, 1e-3 * peak_after + 1e-9);
    EXPECT_NEAR(tissue.mean().peak, mean.peak, 1e-3 * mean.peak + 1e-9);
    EXPECT_NEAR(tissue.mean().volume, mean.volume, 1e-3 * mean.volume + 1e-9);
  }
}

TEST(PulsedTissue, ItsMeanIsThatOfConstantPower) {
  // In the long run: the pulses' ripple has no mean of its own.
  const auto model = coarse_full_model(normalized(Tissue{}));
  PulsedTissue tissue(model, kPulsePeriod, kAlpha, GrueneisenCurve(water_like_curve()));
  FullOrderPlant constant(model, Discretization::kZeroOrderHold, kPulsePeriod, kAlpha);
  constexpr double kPower = 0.02;
  for (int i = 0; i < 2000; ++i) {
    tissue.pulse(kPower * kPulsePeriod);
    constant.step(kPower);
  }
  // After 200 ms the temperature still rises by some 1e-3 K per pulse period; half of that.
  EXPECT_NEAR(tissue.mean().peak, constant.outputs().peak, 5e-3);
  EXPECT_NEAR(tissue.mean().volume, constant.outputs().volume, 5e-3);
  EXPECT_LT(tissue.before().peak, tissue.mean().peak - 0.2) << "pulses hear it before their heat";
  EXPECT_GT(tissue.peak_after(), tissue.mean().peak + 0.5) << "and the peak rides above";
}

TEST(PulsedTissue, KnowsTheChoroidsOwnFactor) {
  const auto model = coarse_full_model(normalized(with_beta()));
  constexpr double kPower = 0.02;
  for (const AbsorptionFactors at : {AbsorptionFactors{1.1, 0.6}, AbsorptionFactors{0.8, 1.7}}) {
    PulsedTissue tissue(model, kPulsePeriod, at, GrueneisenCurve(water_like_curve()));
    FullOrderPlant constant(model, Discretization::kZeroOrderHold, kPulsePeriod, at);
    for (int i = 0; i < 2000; ++i) {
      tissue.pulse(kPower * kPulsePeriod);
      constant.step(kPower);
    }
    // As in the test above.
    EXPECT_NEAR(tissue.mean().peak, constant.outputs().peak, 5e-3) << at.beta;
    EXPECT_NEAR(tissue.mean().volume, constant.outputs().volume, 5e-3) << at.beta;
  }
}

TEST(PulsedTissue, ALineHearsTheMeanAndABentCurveTheMeanOfTheCurve) {
  const auto model = coarse_full_model(normalized(Tissue{}));
  const GrueneisenCurve line(water_like_curve());
  const GrueneisenCurve curve(bent());
  PulsedTissue straight(model, kPulsePeriod, kAlpha, line);
  PulsedTissue curved(model, kPulsePeriod, kAlpha, curve);
  ModalStepper stepper(model, Discretization::kZeroOrderHold, kPulsePeriod, 0.0);
  EXPECT_DOUBLE_EQ(curved.signal(), curve.value(22.0));
  for (int i = 0; i < 100; ++i) {
    straight.pulse(5e-6);
    curved.pulse(5e-6);
    if (i < 99) curved.signal();
    slow_pulse(stepper, 5e-6);
    stepper.set_period(kPulsePeriod - 1e-9);
    stepper.step(0.0);
  }
  EXPECT_DOUBLE_EQ(straight.signal(), line.value(22.0 + straight.before().volume));
  // All cells: beam power per ring times absorbed fraction per depth.
  const Eigen::MatrixXd cells = stepper.temperatures(kAlpha);
  const Modes& radial = model->radial();
  const Eigen::VectorXd rings =
      radial.to_cells(model->beam()).cwiseProduct(radial.root_measure.cwiseAbs2());
  double total = 0.0;
  double of_curve = 0.0;
  double of_temperature = 0.0;
  for (Eigen::Index j = 0; j < cells.cols(); ++j) {
    const double absorbed =
        model->cell_absorption()[static_cast<std::size_t>(j)].evaluate(kAlpha).value;
    for (Eigen::Index i = 0; i < cells.rows(); ++i) {
      const double weight = rings[i] * absorbed;
      total += weight;
      of_curve += weight * curve.value(22.0 + cells(i, j));
      of_temperature += weight * cells(i, j);
    }
  }
  EXPECT_NEAR(of_temperature / total, curved.before().volume, 1e-3);
  const double gap = of_curve / total - curve.value(22.0 + of_temperature / total);
  const double found = curved.signal() - curve.value(22.0 + curved.before().volume);
  // Groups of cells leave out the spread inside a group: 6 rings and 16 depths.
  EXPECT_NEAR(found, gap, 0.1 * gap);
  EXPECT_GT(gap / curve.slope(22.0 + of_temperature / total), 0.3) << "K: it matters";
}

TEST(PulsedTissue, TheGapOfBentCurvesIsWhatTheDocumentSays) {
  // docs/photoacoustics.md, "How accurate": alpha = 1.1, 100 ms of constant power.
  struct Row {
    double bend;   // 1/K2, third coefficient beside 0.05 + 0.004 T
    double power;  // W
    double gap;    // K
  };
  for (const Row& row : {Row{2e-5, 8e-3, 0.03}, Row{2e-5, 25e-3, 0.24}, Row{6e-5, 8e-3, 0.06},
                         Row{6e-5, 25e-3, 0.46}}) {
    CurveData data = bent();
    data.coefficients[2] = row.bend;
    const GrueneisenCurve curve(data);
    PulsedTissue tissue(coarse_full_model(normalized(Tissue{})), kPulsePeriod, 1.1, curve);
    double signal = 0.0;
    for (int i = 0; i < 1000; ++i) {
      tissue.pulse(row.power * kPulsePeriod);
      signal = tissue.signal();
    }
    const double gap = curve.temperature(signal) - 22.0 - tissue.before().volume;
    EXPECT_NEAR(gap, row.gap, 0.005)
        << "peak " << tissue.mean().peak << " K, volume " << tissue.mean().volume << " K";
  }
}

TEST(PulsedTissue, NothingIsAllocatedPerPulse) {
  const auto model = coarse_full_model(Tissue{});
  PulsedTissue tissue(model, kPulsePeriod, kAlpha, GrueneisenCurve(bent()));
  const HeapGuard guard;
  tissue.pulse(1e-6);
  const double signal = tissue.signal();
  tissue.reset();
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
  EXPECT_GT(signal, 0.0);
  EXPECT_EQ(tissue.before().peak, 0.0);
}

TEST(PulsedTissue, LayersThatConductDifferentlyAreRefused) {
  EXPECT_NE(message_of([] {
              PulsedTissue(coarse_full_model(layered()), kPulsePeriod, kAlpha,
                           GrueneisenCurve(water_like_curve()));
            }).find("conduct alike"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
