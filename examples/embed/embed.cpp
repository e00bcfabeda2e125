// Runs the controller on measured samples: one volume temperature, K, per line on standard input;
// prints the laser power, W, for the next period. Research software, not a medical device.
#include <cstdio>
#include <photocoag/core/error.hpp>
#include <photocoag/loop/controller.hpp>
#include <photocoag/rom/file.hpp>

int main(int argc, char** argv) try {
  const photocoag::ReducedModel model =
      photocoag::load_reduced_model(argc > 1 ? argv[1] : "model.json");
  photocoag::ControlSettings control;  // defaults: 30 K, limit 32 K, at most 0.1 W
  control.period = model.period;
  photocoag::Controller controller(model, control, photocoag::EstimatorSettings{});
  double power = controller.decide().power;  // W, for the first period
  std::printf("%.6f\n", power);
  double measured = 0.0;  // K
  while (std::scanf("%lf", &measured) == 1) {
    power = controller.step({.volume_temperature = measured, .applied_power = power}).power;
    std::printf("%.6f\n", power);
  }
} catch (const photocoag::Error& error) {
  std::fprintf(stderr, "embed: %s\n", error.what());
  return 2;
}
