// The supervisor's own model of the eye: what it was made from, and never below the truth.
#include "photocoag/safety/witness.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "estimation/test_models.hpp"
#include "photocoag/fom/stepper.hpp"
#include "safety/supervisors.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {
namespace {

TEST(Witness, AgreesWithTheFullOrderModelItDoesNotKnow) {
  const auto full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{20000});
  for (const Discretization scheme : kDiscretizations) {
    const WitnessModel model = witness_model(Tissue{}, {}, 1e-3, scheme);
    for (const std::size_t j : {5U, 20U, 47U}) {
      FullOrderPlant eye(full, scheme, 1e-3, model.absorption[j]);
      std::array<double, kWitnessModes> lag{};
      for (int k = 0; k < 60; ++k) {
        const double power = k % 17 < 9 ? 0.05 : 0.0;
        eye.step(power);
        double volume = 0.0;
        double peak = 0.0;
        for (std::size_t i = 0; i < kWitnessModes; ++i) {
          lag[i] = model.decay[i] * lag[i] + power;
          volume += model.volume[j][i] * lag[i];
          peak += model.peak[j][i] * lag[i];
        }
        // The error that it says it has, and that of a grid of 20,000 cells.
        ASSERT_NEAR(peak, eye.outputs().peak, model.peak_error_K + 2e-3 * eye.outputs().peak) << k;
        ASSERT_NEAR(volume, eye.outputs().volume, 0.02 + 2e-3 * eye.outputs().volume) << k;
      }
    }
  }
}

// Where beta is unknown too: the truth stays among the plausible, and its peak below the bound.
TEST(Witness, TwoUnknownsAreBoundedFromAbove) {
  const auto full = std::make_shared<const FullOrderModel>(with_beta(), GridSettings{20000});
  const EstimatorSettings both{.unknowns = Unknowns::kRpeAndChoroid};
  const WitnessModel model = witness_model(with_beta(), both, 1e-3, Discretization::kZeroOrderHold);
  EXPECT_EQ(model.choroids, kWitnessChoroids);
  for (const double alpha : {0.4, 0.9, 1.5}) {
    for (const double beta : {0.5, 0.93, 1.9}) {  // not on the grid
      Witness witness(model, 0.288, 0.01);
      FullOrderPlant eye(full, Discretization::kZeroOrderHold, 1e-3, {alpha, beta});
      Draw draw(3);
      for (int k = 0; k < 250; ++k) {
        const double power = k < 3 ? 0.08 : 0.025;
        eye.step(power);
        witness.emit(power);
        const double sample = eye.outputs().volume + 0.288 * draw.normal();
        EXPECT_LT(witness.compare(sample).outside, 6.0) << k;
        witness.learn(sample);
        // Between the nodes of beta the witness may be a little too low, by less than its 1 %.
        EXPECT_GT(witness.peak_high(), 0.99 * eye.outputs().peak)
            << alpha << ' ' << beta << ' ' << k;
        EXPECT_LE(witness.power_for_peak(32.0), 32.0 / eye.outputs().peak) << k;
      }
      // Both have been told apart; 9 % too high at most is seen, with a weak RPE.
      EXPECT_LT(witness.peak_high(), 1.12 * eye.outputs().peak) << alpha << ' ' << beta;
      EXPECT_GT(witness.compare(eye.outputs().volume + 5.0).outside, 6.0);
    }
  }
}

// A spike of any size in any of the first cycles: the truth stays plausible, and once two honest
// samples agree the bound comes down.
TEST(Witness, NoSingleSampleExcludesTheTruth) {
  const WitnessModel model = witness_for(model_1khz());
  for (const double alpha : {0.35, 0.7363, 1.5}) {
    for (const double spike : {-25.0, -12.0, -6.0, -3.0, -1.0, 1.0, 3.0, 6.0, 12.0, 25.0}) {
      for (const int when : {0, 1, 2, 3, 4, 5, 20}) {
        Witness witness(model, 0.288, 0.01);
        ReducedPlant eye(model_1khz(), alpha);
        for (int k = 0; k < 30; ++k) {
          eye.step(0.02);
          witness.emit(0.02);
          witness.learn(eye.outputs().volume + (k == when ? spike : 0.0));
          ASSERT_GE(witness.absorption_high(), alpha)
              << alpha << ' ' << spike << ' ' << when << ' ' << k;
        }
        if (spike < 0.0) {
          EXPECT_LT(witness.absorption_high(), 1.4 * alpha) << spike << ' ' << when;
        }
      }
    }
  }
}

TEST(Witness, CountsEveryAbsorptionWhileItIsSuspicious) {
  const WitnessModel model = witness_for(model_1khz());
  Witness witness(model, 0.288, 0.01);
  ReducedPlant eye(model_1khz(), 0.5);
  for (int k = 0; k < 40; ++k) {
    eye.step(0.02);
    witness.emit(0.02);
    witness.learn(eye.outputs().volume);
  }
  const double trusting = witness.power_for_peak(32.0);
  EXPECT_TRUE(witness.compare(eye.outputs().volume + 5.0).above);
  EXPECT_FALSE(witness.compare(eye.outputs().volume - 5.0).above);
  witness.suspect(true);
  EXPECT_LT(witness.power_for_peak(32.0), 0.3 * trusting);
  EXPECT_LT(witness.steady_power(30.0), 0.5 * trusting);
  witness.suspect(false);
  EXPECT_EQ(witness.power_for_peak(32.0), trusting) << "nothing is forgotten";
}

TEST(Witness, FindsTheAbsorptionFromAbove) {
  const WitnessModel model = witness_for(model_1khz());
  Witness witness(model, 0.288, 0.01);
  EXPECT_EQ(witness.absorption_high(), 2.0) << "nothing known: the worst";
  Witness single = witness;
  single.emit(0.025);
  single.learn(0.0);
  EXPECT_EQ(single.absorption_high(), 2.0) << "one sample is no evidence";
  ReducedPlant eye(model_1khz(), 0.9);
  Draw draw(3);
  for (int k = 0; k < 60; ++k) {
    eye.step(0.025);
    witness.emit(0.025);
    const double sample = eye.outputs().volume + 0.288 * draw.normal();
    EXPECT_LT(witness.compare(sample).outside, 6.0) << k;
    witness.learn(sample);
    // 3.5 standard deviations: the truth is below in all of 60 cycles.
    EXPECT_GT(witness.absorption_high(), 0.9) << k;
  }
  EXPECT_LT(witness.absorption_high(), 0.97);  // half of the samples in each opinion
  EXPECT_GT(witness.compare(eye.outputs().volume + 3.0).outside, 6.0);
  witness.doubt();
  EXPECT_EQ(witness.absorption_high(), 2.0);
}

}  // namespace
}  // namespace photocoag::testing
