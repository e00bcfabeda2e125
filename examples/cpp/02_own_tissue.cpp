// A tissue of one's own: layers in the order in which the light meets them. Research software, not
// a medical device.
#include <cstdio>
#include <memory>
#include <photocoag/core/error.hpp>
#include <photocoag/fom/stepper.hpp>

int main() try {
  using namespace photocoag;
  Tissue tissue;
  tissue.spot_radius = 75e-6;  // m
  tissue.layers = {
      {.name = "retina", .thickness = 200e-6, .absorption = 0.0},
      {.name = "RPE",
       .thickness = 8e-6,
       .absorption = 1e5,
       .scaled_by = photocoag::ScaledBy::kAlpha},
      {.name = "choroid", .thickness = 400e-6, .absorption = 3e3},
      {.name = "sclera", .thickness = 700e-6, .absorption = 0.0},
  };
  tissue.peak_layer = "RPE";
  tissue.validate("tissue");  // names key, value and range
  const auto model = std::make_shared<const FullOrderModel>(tissue, GridSettings{});
  for (const double absorption : {0.5, 1.0, 1.5}) {
    FullOrderPlant eye(model, Discretization::kZeroOrderHold, 0.1, absorption);
    eye.step(0.02);  // one step of 0.1 s: exact for constant power
    std::printf("absorption factor %.1f: peak %.3f K after 0.1 s\n", absorption,
                eye.outputs().peak);
  }
} catch (const photocoag::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
