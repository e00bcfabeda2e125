// The controller inside a program of one's own: sample in, power out, nothing allocated in between.
// Here a model file's own tissue plays the eye; examples/embed reads samples instead. Research
// software, not a medical device.
#include <cstdio>
#include <photocoag/core/error.hpp>
#include <photocoag/loop/controller.hpp>
#include <photocoag/rom/file.hpp>

int main(int argc, char** argv) try {
  using namespace photocoag;
  const ReducedModel model = load_reduced_model(argc > 1 ? argv[1] : "model.json");
  ControlSettings control;  // 30 K, limit 32 K, at most 0.1 W
  control.period = model.period;
  Controller controller(model, control, EstimatorSettings{});
  ReducedPlant eye(model, /*absorption=*/1.1);
  double power = controller.decide().power;  // W, of the first period
  double peak = 0.0;
  for (int k = 0; k < 100; ++k) {
    eye.step(power);
    const Outputs now = eye.outputs();
    peak = now.peak > peak ? now.peak : peak;
    power = controller.step({.volume_temperature = now.volume, .applied_power = power}).power;
  }
  std::printf("peak at most %.2f K, now %.2f K at %.2f mW\n", peak, eye.outputs().peak,
              power * 1e3);
} catch (const photocoag::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
