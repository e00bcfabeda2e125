// Estimates the unmeasured peak and the absorption from noisy samples of the volume temperature.
// Research software, not a medical device.
#include <cstdio>
#include <memory>
#include <photocoag/core/error.hpp>
#include <photocoag/core/random.hpp>
#include <photocoag/estimation/ekf.hpp>
#include <photocoag/fom/stepper.hpp>
#include <photocoag/mor/reduce.hpp>

int main() try {
  using namespace photocoag;
  const double period = 1e-3;  // s
  const double power = 0.02;   // W
  const double absorption = 1.1;
  const auto full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{});
  const ReducedModel model =
      reduce(full, ReductionSettings{}, period, Discretization::kZeroOrderHold);
  FullOrderPlant eye(full, Discretization::kZeroOrderHold, period, absorption);
  ExtendedKalmanFilter filter(model, EstimatorSettings{});  // believes 0.7363 at first
  for (std::uint64_t k = 0; k < 100; ++k) {
    eye.step(power);
    const double noise =
        0.288 * standard_normal(/*seed=*/1, k, RandomStream::kMeasurementNoise);  // K
    filter.predict(power);
    filter.update(eye.outputs().volume + noise);
  }
  std::printf("peak %.2f K, estimated %.2f +- %.2f K\n", eye.outputs().peak, filter.outputs().peak,
              filter.peak_sigma());
  std::printf("absorption factor %.3f, estimated %.3f +- %.3f\n", absorption,
              filter.absorption_factor(), filter.absorption_sigma());
} catch (const photocoag::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
