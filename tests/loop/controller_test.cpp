// One controller step: what it sees, and what it does with bad input.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "estimation/test_models.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/loop/controller.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Powers and true peaks of `cycles` on a reduced eye; samples that `missing` names do not arrive.
struct Course {
  std::vector<double> power;
  std::vector<double> peak;
};

template <typename Missing>
Course run(Controller& controller, double alpha, int cycles, std::uint64_t seed, Missing missing) {
  ReducedPlant plant(model_1khz(), alpha);
  Draw draw(seed);
  Course course;
  double power = controller.decide().power;
  for (int k = 0; k < cycles; ++k) {
    plant.step(power);
    course.power.push_back(power);
    course.peak.push_back(plant.outputs().peak);
    const double sample = plant.outputs().volume + 0.288 * draw.normal();
    controller.observe({.volume_temperature = missing(k) ? kNaN : sample, .applied_power = power});
    power = controller.decide().power;
  }
  return course;
}

Course run(Controller& controller, double alpha, int cycles, std::uint64_t seed) {
  return run(controller, alpha, cycles, seed, [](int) { return false; });
}

TEST(Controller, SeesTheSampleOnly) {
  // Eyes that differ in alpha: the same first power to the last bit, later powers not.
  Controller one(model_1khz(), {}, {});
  Controller two(model_1khz(), {}, {});
  const Course weak = run(one, 0.5, 50, 1);
  const Course strong = run(two, 1.1, 50, 1);
  EXPECT_EQ(weak.power[0], strong.power[0]);
  EXPECT_NE(weak.peak[0], strong.peak[0]);
  EXPECT_NE(weak.power[10], strong.power[10]);
}

TEST(Controller, RepeatsBitForBit) {
  for (const int horizon : {2, 5, 20}) {
    const ControlSettings settings{.horizon = horizon, .power_change_weight = 5e4};
    Controller one(model_1khz(), settings, {});
    Controller two(model_1khz(), settings, {});
    const Course first = run(one, 0.8, 250, 7);
    const Course second = run(two, 0.8, 250, 7);
    EXPECT_EQ(first.power, second.power);
    EXPECT_EQ(first.peak, second.peak);
  }
}

TEST(Controller, StepIsObserveAndDecide) {
  Controller one(model_1khz(), {}, {});
  Controller two(model_1khz(), {}, {});
  one.decide();
  two.decide();
  Draw draw(3);
  for (int k = 0; k < 100; ++k) {
    const Sample sample{.volume_temperature = draw.chance(0.1) ? kNaN : draw.between(0.0, 20.0),
                        .applied_power = draw.chance(0.1) ? kNaN : draw.between(0.0, 0.1)};
    const Decision stepped = one.step(sample);
    two.observe(sample);
    const Decision decided = two.decide();
    ASSERT_EQ(stepped.power, decided.power);
    ASSERT_EQ(stepped.power_reference, decided.power_reference);
    ASSERT_EQ(stepped.status, decided.status);
  }
}

TEST(Controller, MissingSamplesCoast) {
  Controller controller(model_1khz(), {}, {});
  const Course course = run(controller, 1.1, 250, 5, [](int k) { return k >= 60 && k < 160; });
  // 60 samples give alpha to 2 %; the eye matches the model: held for 100 ms on prediction alone.
  for (int k = 60; k < 160; ++k) ASSERT_NEAR(course.peak[k], 30.0, 1.0) << k;
  // And with samples again it settles to what noise allows.
  for (int k = 200; k < 250; ++k) ASSERT_NEAR(course.peak[k], 30.0, 0.4) << k;
}

TEST(Controller, WithNoSampleAtAllItTrustsItsPrior) {
  Controller controller(model_1khz(), {}, {});
  const Course course = run(controller, 0.7363, 100, 5, [](int) { return true; });
  // Then the model alone is controlled, and R1 = R2 = 0 is deadbeat: exactly the reference.
  EXPECT_NEAR(course.peak.back(), 30.0, 1e-9);
  EXPECT_EQ(controller.estimate().absorption_factor, 0.7363);
}

TEST(Controller, AnUnknownAppliedPowerIsTheCommand) {
  Controller told(model_1khz(), {}, {});
  Controller untold(model_1khz(), {}, {});
  double power = told.decide().power;
  untold.decide();
  for (int k = 0; k < 50; ++k) {
    const double sample = 0.3 * k;
    const double unknown = k % 2 == 0 ? kNaN : std::numeric_limits<double>::infinity();
    power = told.step({.volume_temperature = sample, .applied_power = power}).power;
    const Decision decision = untold.step({.volume_temperature = sample, .applied_power = unknown});
    ASSERT_EQ(decision.power, power) << k;
  }
}

TEST(Controller, PredictsWithThePowerThatWasApplied) {
  Controller controller(model_1khz(), {}, {});
  EXPECT_GT(controller.decide().power, 0.0);
  const Estimate dark = controller.observe({.volume_temperature = kNaN, .applied_power = 0.0});
  EXPECT_EQ(dark.status, UpdateStatus::kNoSample);
  EXPECT_EQ(dark.outputs.peak, 0.0) << "the laser was off: nothing was heated";
}

TEST(Controller, EveryPowerIsSafeWhateverIsMeasured) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    ControlSettings settings{.horizon = 2 + static_cast<int>(seed), .power_weight = 5e1};
    settings.power_min = seed % 2 == 0 ? 0.004 : 0.0;
    Controller controller(model_1khz(), settings, {});
    Draw draw(seed);
    for (int k = 0; k < 500; ++k) {
      const double size = std::pow(10.0, draw.between(-310.0, 308.0));
      const double wild = draw.chance(0.2) ? kNaN : (draw.chance(0.5) ? size : -size);
      const double power = draw.chance(0.1) ? kNaN : draw.between(0.0, 0.1);
      const Decision decision =
          controller.step({.volume_temperature = wild, .applied_power = power});
      ASSERT_TRUE(decision.power >= 0.0 && decision.power <= 0.1) << decision.power;
      ASSERT_TRUE(decision.power == 0.0 || decision.power >= settings.power_min);
      ASSERT_TRUE(std::isfinite(controller.estimate().outputs.peak));
    }
  }
}

TEST(Controller, RefusesAModelForAnotherPeriod) {
  EXPECT_THROW(Controller(model_250hz(), {}, {}), Error);
  EXPECT_NO_THROW(Controller(model_250hz(), {.period = 4e-3}, {}));
}

}  // namespace
}  // namespace photocoag::testing
