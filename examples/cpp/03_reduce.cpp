// Reduces the full-order model, prints the measured error and writes the model file. Research
// software, not a medical device.
#include <cstdio>
#include <memory>
#include <photocoag/core/error.hpp>
#include <photocoag/mor/reduce.hpp>
#include <photocoag/rom/file.hpp>

int main(int argc, char** argv) try {
  using namespace photocoag;
  const auto full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{});
  const ReducedModel model =
      reduce(full, ReductionSettings{}, /*period=*/1e-3, Discretization::kZeroOrderHold);
  std::printf("%zu states reduced to %d\n", full->states(), model.order());
  std::printf("largest error: %.2f %% of the peak, %.2f %% of the volume temperature\n",
              100.0 * model.error.peak_max(), 100.0 * model.error.volume_max());
  save_reduced_model(model, argc > 1 ? argv[1] : "model.json");
} catch (const photocoag::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
