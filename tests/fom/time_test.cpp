// Time discretization of the full-order model: order, bias, and what implicit Euler really
// computes.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "photocoag/core/step_response.hpp"
#include "photocoag/fom/stepper.hpp"

namespace photocoag {
namespace {

std::shared_ptr<const FullOrderModel> coarse_model() {
  static const auto model =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 5000});
  return model;
}

Outputs response(Discretization how, double period, double time) {
  FullOrderPlant plant(coarse_model(), how, period, 0.7363, 0.0);
  return sample_step_response(plant, how, period, 1.0, {time}).front();
}

TEST(Time, ImplicitEulerIsOfOrderOne) {
  for (const double time : {20e-3, 100e-3}) {
    const Outputs exact = response(Discretization::kZeroOrderHold, 1e-3, time);
    double last[2] = {};
    for (const double period : {1e-3, 0.5e-3, 0.25e-3, 0.125e-3}) {
      const Outputs euler = response(Discretization::kImplicitEuler, period, time);
      const double error[2] = {exact.peak - euler.peak, exact.volume - euler.volume};
      for (int output = 0; output < 2; ++output) {
        EXPECT_GT(error[output], 0.0) << "implicit Euler underestimates a step response";
        if (last[output] > 0.0) {
          // The next term of the error is of order h / t: below 3 % here.
          EXPECT_NEAR(std::log2(last[output] / error[output]), 1.0, 0.05);
        }
        last[output] = error[output];
      }
    }
  }
}

// The bias for which zero-order hold is the default: 12 % low after the first step at 1 ms, 13 % at
// 4 ms, 6 to 8 % after the second, 2 % after the tenth.
TEST(Time, ImplicitEulerStartsTooLow) {
  const auto low = [](double period, int steps) {
    const double time = steps * period;
    return 1.0 - response(Discretization::kImplicitEuler, period, time).peak /
                     response(Discretization::kZeroOrderHold, period, time).peak;
  };
  EXPECT_NEAR(low(1e-3, 1), 0.12, 0.005);
  EXPECT_NEAR(low(4e-3, 1), 0.13, 0.005);
  EXPECT_NEAR(low(1e-3, 2), 0.07, 0.01);
  EXPECT_NEAR(low(4e-3, 2), 0.07, 0.015);
  EXPECT_NEAR(low(1e-3, 10), 0.02, 0.005);
}

// n implicit Euler steps of size h from rest give the mean of the exact step response over a
// Gamma(n, h) distributed time. The mean by the trapezoidal rule in the logarithm of time, where
// the integrand is smooth and falls off on both sides, so that the rule converges exponentially.
TEST(Time, ImplicitEulerAveragesOverAGammaDistributedTime) {
  constexpr double kSpacing = 0.04;
  for (const double period : {1e-3, 4e-3}) {
    std::vector<double> times;
    for (double v = -16.0; v < 4.6; v += kSpacing) times.push_back(period * std::exp(v));
    FullOrderPlant exact(coarse_model(), Discretization::kZeroOrderHold, period, 0.7363, 0.0);
    const auto samples =
        sample_step_response(exact, Discretization::kZeroOrderHold, period, 1.0, times);
    for (const int steps : {1, 2, 5, 20}) {
      Outputs mean;
      double total = 0.0;
      for (std::size_t i = 0; i < times.size(); ++i) {
        const double x = times[i] / period;
        const double density = std::exp(steps * std::log(x) - x - std::lgamma(double(steps)));
        mean.peak += kSpacing * density * samples[i].peak;
        mean.volume += kSpacing * density * samples[i].volume;
        total += kSpacing * density;
      }
      const Outputs euler = response(Discretization::kImplicitEuler, period, steps * period);
      // The ends cut off exp(-16) of a response that is itself that small, and exp(-100).
      EXPECT_NEAR(total, 1.0, 2e-7);
      EXPECT_NEAR(mean.peak / euler.peak, 1.0, 1e-9) << steps;
      EXPECT_NEAR(mean.volume / euler.volume, 1.0, 1e-9) << steps;
    }
  }
}

TEST(Time, ZeroOrderHoldDoesNotDependOnTheStep) {
  const Outputs one = response(Discretization::kZeroOrderHold, 1e-3, 50e-3);
  FullOrderPlant plant(coarse_model(), Discretization::kZeroOrderHold, 1e-3, 0.7363, 0.0);
  for (int i = 0; i < 50; ++i) plant.step(1.0);
  EXPECT_NEAR(plant.outputs().peak / one.peak, 1.0, 1e-12);
  EXPECT_NEAR(plant.outputs().volume / one.volume, 1.0, 1e-12);
}

}  // namespace
}  // namespace photocoag
