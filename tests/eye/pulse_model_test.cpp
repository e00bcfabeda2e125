// The reduced model and the observer with samples that are means over pulses, against pulses one by
// one.
#include "photocoag/run/pulse_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "photocoag/eye/pulsed_tissue.hpp"
#include "photocoag/run/supervision.hpp"
#include "support/reduced_models.hpp"
#include "support/thrown.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {
namespace {

TEST(PulseModel, AModeIsSeenAsPulsesSeeIt) {
  for (const int m : {1, 2, 10}) {
    for (const double rate : {0.1, 30.0, 2000.0, 40000.0}) {  // 1/s
      const double period = 1e-3;
      const double pulse_period = period / m;
      const double decay = std::exp(-rate * period);
      const PulseAveragedMode seen = pulse_averaged_mode(decay, m);
      // x' = -rate x + u, from 0 with u = 3, then u = 2.
      const double whole = (1.0 - decay) / rate;
      double x = 0.0;
      double mean = 0.0;
      for (int p = 0; p < 2 * m; ++p) {
        if (p >= m) mean += x / m;
        x = (x + (p < m ? 3.0 : 2.0) * pulse_period) * std::exp(-rate * pulse_period);
      }
      EXPECT_NEAR(seen.before * 3.0 * whole + seen.power * 2.0 * whole, mean, 1e-9 * mean + 1e-18)
          << m << " " << rate;
    }
  }
  EXPECT_EQ(pulse_averaged_mode(0.0, 4).before, 0.0) << "gone before any pulse could hear it";
}

TEST(PulseModel, TheModelFollowsThePulses) {
  constexpr double kAlpha = 0.8;
  constexpr int kPulses = 5;
  const ReducedModel model = coarse_model(normalized(Tissue{}));
  // The same tissue in steps of one pulse period, for the reference.
  ReducedModel fine = model;
  fine.discretize(model.period / kPulses, Discretization::kZeroOrderHold);
  ParametricMatrices at;
  ParametricMatrices continuous = {};
  model.evaluate(kAlpha, at);
  fine.evaluate(kAlpha, continuous);
  // A pulse is the continuous B times energy: from the finest steps there are.
  ReducedModel finest = model;
  finest.discretize(1e-10, Discretization::kZeroOrderHold);
  ParametricMatrices instant;
  finest.evaluate(kAlpha, instant);
  const Eigen::VectorXd per_joule = instant.input / 1e-10;

  ReducedPlant seen(pulse_averaged_model(model, kPulses), kAlpha);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(model.order());
  for (const double power : {0.1, 0.1, 0.03, 0.0, 0.05}) {
    double mean = 0.0;
    for (int p = 0; p < kPulses; ++p) {
      mean += Eigen::VectorXd(at.volume).dot(x) / kPulses;
      x = Eigen::MatrixXd(fine.A_d) * (x + per_joule * (power * model.period / kPulses));
    }
    seen.step(power);
    // The instant of a pulse is 1e-10 s here.
    EXPECT_NEAR(seen.outputs().volume, mean, 1e-5 * std::abs(mean) + 1e-9);
  }
}

// The observer has its numbers from elsewhere: it must hear what pulses hear of the full model.
TEST(PulseModel, TheObserverHearsWhatPulsesHear) {
  constexpr int kPulses = 10;
  const Tissue tissue = normalized(Tissue{});
  const auto full = std::make_shared<const FullOrderModel>(tissue, GridSettings{20000});
  const ObserverModel data =
      observer_model(tissue, {}, 1e-3, Discretization::kZeroOrderHold, 0.1, kPulses);
  for (const double alpha : {0.5, 1.1, 1.6}) {
    PulsedTissue eye(full, 1e-3 / kPulses, alpha, GrueneisenCurve(water_like_curve()));
    MultiModelObserver observer(data, 0.02, 0.01);
    for (int k = 0; k < 100; ++k) {
      const double power = k % 30 < 20 ? 0.03 : 0.01;
      double heard = 0.0;
      for (int p = 0; p < kPulses; ++p) {
        heard += eye.before().volume / kPulses;
        eye.pulse(power * 1e-3 / kPulses);
      }
      observer.emit(power);
      if (k == 0) continue;  // its first pulse has heard nothing at all
      EXPECT_LT(observer.compare(heard).outside, 0.5) << alpha << ' ' << k;
      observer.update(heard);
      EXPECT_GT(observer.absorption_high(), 0.99 * alpha) << k;
    }
    EXPECT_LT(observer.absorption_high(), 1.08 * alpha);
  }
}

TEST(PulseModel, HeatYoungerThanAPulsePeriodIsThatOfTheFullModel) {
  constexpr int kPulses = 10;
  constexpr double kPower = 0.025;
  const auto full = coarse_full_model(normalized(Tissue{}));
  const ReducedModel model = coarse_model(normalized(Tissue{}));
  const double pulse_period = model.period / kPulses;
  const PromptFeedthrough feed = prompt_feedthrough(full, model, kPulses);
  // Root mean square difference between what pulses hear and what the model says they do, relative.
  const auto misfit = [&](double alpha, const PromptFeedthrough& with) {
    PulsedTissue tissue(full, pulse_period, alpha, GrueneisenCurve(water_like_curve()));
    ReducedPlant seen(pulse_averaged_model(model, kPulses, with), alpha);
    double squares = 0.0;
    double largest = 0.0;
    for (int k = 0; k < 100; ++k) {
      double heard = 0.0;
      for (int p = 0; p < kPulses; ++p) {
        heard += tissue.before().volume / kPulses;
        tissue.pulse(kPower * pulse_period);
      }
      seen.step(kPower);
      if (k == 0) continue;  // its first pulse has heard nothing at all
      squares += std::pow(seen.outputs().volume - heard, 2) / 99.0;
      largest = std::max(largest, heard);
    }
    return std::sqrt(squares) / largest;
  };
  for (const double alpha : {0.5, 1.1, 1.6}) {
    // What is left is the reduced model's own error, within 1 % of the largest value.
    EXPECT_LT(misfit(alpha, feed), 0.005) << alpha;
    EXPECT_LT(misfit(alpha, feed), 0.7 * misfit(alpha, {})) << alpha;
    EXPECT_LT(feed(alpha), -0.5) << alpha << ": K/W, the model of few states shows too much";
    // The nearest combination of the model's terms is near.
    ReducedPlant with(pulse_averaged_model(model, kPulses, feed), alpha);
    ReducedPlant without(pulse_averaged_model(model, kPulses), alpha);
    with.step(1.0);
    without.step(1.0);
    EXPECT_NEAR(with.outputs().volume - without.outputs().volume, feed(alpha),
                0.01 * std::abs(feed(alpha)) + 0.02)
        << alpha;
  }
  EXPECT_NEAR(feed(1.1), -6.0, 1.0) << "docs/photoacoustics.md (P9)";
  EXPECT_FALSE(prompt_feedthrough(full, model, 1)) << "a single pulse hears none of its period";
}

TEST(PulseModel, WhatCannotBeSeenIsRefused) {
  ReducedModel euler = coarse_model({}, 1e-3, Discretization::kImplicitEuler);
  EXPECT_NE(message_of([&] { pulse_averaged_model(euler, 10); }).find("zero-order-hold"),
            std::string::npos);
  ReductionSettings large;
  large.order = 8;
  const ReducedModel eight =
      reduce(coarse_full_model(), large, 1e-3, Discretization::kZeroOrderHold);
  EXPECT_NE(message_of([&] { pulse_averaged_model(eight, 10); }).find("model.order"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
