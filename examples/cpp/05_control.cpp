// One closed-loop treatment of a simulated eye in virtual time, as `photocoag simulate`. Research
// software, not a medical device.
#include <atomic>
#include <cstdio>
#include <photocoag/core/error.hpp>
#include <photocoag/run/run_folder.hpp>

int main(int argc, char** argv) try {
  using namespace photocoag;
  // A file, then changes as with --set.
  const Config config = load_config(argc > 1 ? argv[1] : "", {"plant.absorption_factor=0.9"});
  ModelStore models(config, /*use_cache=*/true);
  const std::atomic<bool> stop{false};
  std::atomic<std::size_t> progress{0};
  const Treatment treatment = run_treatment(config, models, virtual_eye(), stop, progress);
  const RunSummaryNumbers numbers = summarize(config, treatment);
  std::printf("%zu cycles, peak at most %.2f K, limit %g K\n", treatment.records.size(),
              numbers.peak_true_max, numbers.limit);
  for (const CycleRecord& cycle : treatment.records) {
    if (cycle.cycle % 50 == 0) {
      std::printf("%6.1f ms  %6.2f mW  %6.2f K\n", cycle.time * 1e3, cycle.power * 1e3,
                  cycle.truth.peak);
    }
  }
} catch (const photocoag::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
