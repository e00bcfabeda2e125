// Reduced models between the ends of their periods: the eye against small steps, and the model that
// a controller is given against that eye.
#include "photocoag/rom/intersample.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/core/random.hpp"
#include "support/reduced_models.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

constexpr double kAlpha = 0.8;

const ReducedModel& model() {
  static const ReducedModel made = coarse_model(Tissue{});
  return made;
}

double power_of(int period) {
  return period < 0 ? 0.0
                    : 0.1 * uniform(6, static_cast<std::uint64_t>(period), RandomStream::kTest);
}

TEST(ReducedIntersample, InstantsAreThoseOfSmallSteps) {
  constexpr int kParts = 20;
  constexpr int kPowerLag = 7;
  constexpr int kSampleLag = 9;
  ReducedIntersamplePlant plant(model(), kAlpha,
                                {.averaging = 0.0,
                                 .sample_lag = double(kSampleLag) / kParts,
                                 .power_lag = double(kPowerLag) / kParts},
                                0.0);
  ReducedPlant fine(model(), kAlpha);
  fine.set_period(model().period / kParts);
  for (int n = 0; n < 5; ++n) {
    plant.step(power_of(n));
    double seen = 0.0;
    for (int k = 0; k < kParts; ++k) {
      fine.step(power_of(k < kPowerLag ? n - 1 : n));
      if (k + 1 == kParts - kSampleLag) seen = fine.outputs().volume;
    }
    EXPECT_NEAR(plant.sample(), seen, 1e-9 * seen + 1e-12);
    EXPECT_NEAR(plant.outputs().peak, fine.outputs().peak, 1e-9 * fine.outputs().peak);
    EXPECT_NEAR(plant.outputs().volume, fine.outputs().volume, 1e-9 * fine.outputs().volume);
  }
}

// The model's own sample is the eye's, whatever is late; its derivative by alpha comes with it.
TEST(ReducedIntersample, WhatAControllerIsToldIsWhatTheEyeShows) {
  for (const IntersampleTiming timing :
       {IntersampleTiming{1.0, 0.0, 0.0}, IntersampleTiming{0.0, 0.5, 0.0},
        IntersampleTiming{0.25, 0.25, 0.0}, IntersampleTiming{0.4, 0.2, 0.4}}) {
    ReducedIntersamplePlant eye(model(), kAlpha, timing, 0.0);
    ReducedPlant told(controller_model(model(), timing), kAlpha);
    ReducedPlant plain(model(), kAlpha);
    for (int n = 0; n < 6; ++n) {
      eye.step(power_of(n));
      told.step(power_of(n));
      plain.step(power_of(n));
      EXPECT_NEAR(told.outputs().volume, eye.sample(), 1e-9 * eye.sample());
      // Its state is that of the moment at which the next power begins to act.
      EXPECT_NEAR(told.outputs().peak, plain.outputs().peak, 1e-12 * plain.outputs().peak);
    }
  }
}

TEST(ReducedIntersample, NothingToKnowIsTheModelItself) {
  EXPECT_EQ(controller_model(model(), {}).order(), model().order());
  EXPECT_EQ(controller_model(model(), {.averaging = 1.0}).order(), 2 * model().order());
}

TEST(ReducedIntersample, RefusesWhatItCannotTell) {
  ReducedModel euler = model();
  euler.discretize(euler.period, Discretization::kImplicitEuler);
  EXPECT_NE(
      message_of([&] { with_intersample(euler, {.averaging = 1.0}); }).find("zero-order-hold"),
      std::string::npos);
  EXPECT_NE(message_of([&] {
              with_intersample(model(), {1.0, 0.5, 0.0});
            }).find("in sum"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
