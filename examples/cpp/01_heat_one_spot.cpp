// Heats one spot with constant power and prints the temperature rises. Research software, not a
// medical device.
#include <cstdio>
#include <memory>
#include <photocoag/fom/stepper.hpp>

int main() {
  using namespace photocoag;
  const auto model = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{});
  const double period = 1e-3;     // s
  const double power = 0.02;      // W
  const double absorption = 1.1;  // alpha
  FullOrderPlant eye(model, Discretization::kZeroOrderHold, period, absorption);
  std::printf("%zu grid cells\n  ms   peak K  volume K\n", model->states());
  for (int k = 1; k <= 100; ++k) {
    eye.step(power);
    const Outputs now = eye.outputs();
    if (k % 20 == 0) std::printf("%4d  %7.3f  %8.3f\n", k, now.peak, now.volume);
  }
}
