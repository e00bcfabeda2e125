// `photocoag estimation`: the estimator's errors, and their consistency with its stated variance.
#include "estimation.hpp"

#include <fmt/format.h>

#include <chrono>
#include <iterator>
#include <utility>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "estimation_cost.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/percentile.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/estimation/estimator.hpp"
#include "photocoag/population/estimation_study.hpp"
#include "photocoag/population/estimation_table.hpp"

namespace photocoag {
namespace {

std::string csv(const std::vector<EstimationStatistics>& all, double period) {
  std::string text =
      "scenario,time_s,nis,nees,nees_alpha,nees_peak,rms_alpha_relative,sigma_alpha,rms_peak_K,"
      "rejected\n";
  for (const EstimationStatistics& one : all) {
    for (std::size_t k = 0; k < one.cycles.size(); ++k) {
      const EstimationCycle& c = one.cycles[k];
      fmt::format_to(std::back_inserter(text), "\"{}\",{},{},{},{},{},{},{},{},{}\n",
                     one.scenario.name, period * static_cast<double>(k + 1), c.nis, c.nees,
                     c.nees_alpha, c.nees_peak, c.rms_alpha, c.sigma_alpha, c.rms_peak, c.rejected);
    }
  }
  return text;
}

}  // namespace

double estimator_cost_us(const Config& config, const ReducedModel& model,
                         const EstimatorSettings& settings) {
  using Clock = std::chrono::steady_clock;
  AnyEstimator estimator(model, settings);
  ReducedPlant plant(model, config.plant.absorption());
  std::vector<double> us;
  for (std::uint64_t k = 0; k < 4000; ++k) {
    const double power = k < 4 ? 0.1 : 0.025;
    plant.step(power);
    const double noise = config.plant.noise * standard_normal(1, k, RandomStream::kStudy);
    const auto begin = Clock::now();
    estimator.predict(power);
    estimator.update(plant.outputs().volume + noise);
    us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
  return percentile(std::move(us), 0.5);
}

namespace {

int estimation(const EstimationOptions& options) {
  if (options.compare) return compare_estimators(options);
  const Config config = configured(Use::kEstimation, options.config, options.set);
  ModelStore models(config, !options.no_cache);
  const double period = config.control.period;
  const std::size_t cycles = config.cycles();
  print("photocoag {}: {}\n", version(), kResearchNotice);
  print(
      "{} treatments of {:g} ms each; squares in units of the stated variance, 1 is "
      "consistent\n\n",
      options.seeds, config.run.duration * 1e3);
  print("{}", estimation_heading());
  std::vector<EstimationStatistics> all;
  for (const EstimationScenario& scenario : estimation_scenarios(config)) {
    all.push_back(estimation_statistics(config, models, scenario, options.seeds));
    const EstimationStatistics& one = all.back();
    const auto row = [&](std::string_view name, std::size_t begin, std::size_t end) {
      print("{}", estimation_row(name, one.mean(begin, end), period, begin, end));
    };
    const std::size_t edges[] = {0, cycles / 25, cycles / 5, cycles};
    std::string_view first = scenario.name;
    for (int i = 0; i < 3; ++i) {
      if (edges[i] == edges[i + 1]) continue;
      row(first, edges[i], edges[i + 1]);
      first = "";
    }
    row("", 0, cycles);
  }
  const auto cost = [&](EstimatorKind kind) {
    EstimatorSettings settings = config.estimator;
    settings.kind = kind;
    return estimator_cost_us(config, models.reduced(), settings);
  };
  print("\none sample, median: ekf {:.2f} us, mhe with a window of {} {:.2f} us\n",
        cost(EstimatorKind::kEkf), config.estimator.window, cost(EstimatorKind::kMhe));
  if (!options.csv.empty()) write_output(options.csv, csv(all, period));
  return 0;
}

const Command kEstimation(
    "estimation", "accuracy and consistency of the estimator over many simulated eyes", estimation,
    [](CommandLine& command, EstimationOptions& options) {
      add_common(command, options);
      add_cache(command, options);
      command.add_option("--seeds", options.seeds, "treatments per scenario")
          .check(whole_number_from(1, 100000))
          .type_name("N");
      command.add_option("--csv", options.csv, "also every cycle's figures; - is standard output")
          .type_name("FILE");
      command.add_flag(
          "--compare", options.compare,
          "instead: filter against moving horizon for one and two unknown absorption factors");
      command.add_option("--out", options.out, "with --compare: new folder for its CSV and figure")
          .needs("--compare")
          .type_name("DIR");
      command.footer(footer(
          "  photocoag estimation\n"
          "  photocoag estimation --seeds 1000 --set estimator.power_process_noise_W=0\n"
          "  photocoag estimation --compare --config configs/two-unknowns.toml --out runs/mhe\n"
          "Eyes have the tissue of [plant]; their absorption factors are drawn."));
    });

}  // namespace

}  // namespace photocoag
