#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/reduce.hpp"

namespace photocoag {
namespace {

// Largest absolute error and largest absolute value of one output for one alpha.
struct Extreme {
  double error = 0.0;
  double value = 0.0;

  void add(double reference, double approximation) {
    error = std::max(error, std::abs(approximation - reference));
    value = std::max(value, std::abs(reference));
  }
  double relative() const { return value > 0.0 ? error / value : 0.0; }
};

std::vector<double> default_alphas() {
  constexpr int kCount = 29;
  std::vector<double> alphas;
  for (int i = 0; i < kCount; ++i) alphas.push_back(0.3 + 1.4 * i / (kCount - 1));
  return alphas;
}

}  // namespace

std::vector<double> on_off_power(double duration, double period, double mean_dwell,
                                 std::uint64_t seed) {
  std::vector<double> power(static_cast<std::size_t>(std::max(1.0, std::round(duration / period))));
  std::size_t step = 0;
  for (std::uint64_t dwell = 0; step < power.size(); ++dwell) {
    const double time = -mean_dwell * std::log(uniform(seed, dwell, RandomStream::kOnOffPower));
    const auto steps = static_cast<std::size_t>(std::max(1.0, std::ceil(time / period)));
    for (std::size_t i = 0; i < steps && step < power.size(); ++i) {
      power[step++] = dwell % 2 == 0 ? 1.0 : 0.0;
    }
  }
  return power;
}

ValidationRun validation_run(std::shared_ptr<const FullOrderModel> full,
                             Discretization discretization, double period,
                             const ValidationSettings& settings, const Progress& progress) {
  ValidationRun run;
  run.absorption_factors =
      settings.absorption_factors.empty() ? default_alphas() : settings.absorption_factors;
  run.duration = settings.duration;
  run.mean_dwell = settings.mean_dwell;
  run.seed = settings.seed;
  std::vector<OutputWeights> weights;
  for (const double alpha : run.absorption_factors) weights.push_back(full->output_weights(alpha));
  const auto steps =
      static_cast<std::size_t>(std::max(1.0, std::round(settings.duration / period)));
  run.powers = {std::vector<double>(steps, 1.0),
                on_off_power(settings.duration, period, settings.mean_dwell, settings.seed)};
  ModalStepper stepper(full, discretization, period);
  for (std::size_t s = 0; s < run.powers.size(); ++s) {
    std::vector<Outputs>& outputs = run.outputs.emplace_back();
    outputs.reserve(run.powers[s].size() * weights.size());
    stepper.reset();
    for (std::size_t k = 0; k < run.powers[s].size(); ++k) {
      stepper.step(run.powers[s][k]);
      for (const OutputWeights& alpha : weights) outputs.push_back(stepper.outputs(alpha));
      if (progress && k % 50 == 0) {
        progress(
            "measuring its error",
            (static_cast<double>(s) + static_cast<double>(k) / static_cast<double>(steps)) / 2.0);
      }
    }
  }
  return run;
}

ErrorReport measure_error(const ReducedModel& reduced, const ValidationRun& run) {
  const std::size_t count = run.absorption_factors.size();
  ErrorReport report;
  report.absorption_factors = run.absorption_factors;
  report.duration = run.duration;
  report.mean_dwell = run.mean_dwell;
  report.seed = run.seed;
  report.peak.assign(count, 0.0);
  report.volume.assign(count, 0.0);
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t s = 0; s < run.powers.size(); ++s) {
      ReducedPlant plant(reduced, run.absorption_factors[a]);
      Extreme peak;
      Extreme volume;
      for (std::size_t k = 0; k < run.powers[s].size(); ++k) {
        plant.step(run.powers[s][k]);
        const Outputs& reference = run.outputs[s][k * count + a];
        const Outputs approximation = plant.outputs();
        peak.add(reference.peak, approximation.peak);
        volume.add(reference.volume, approximation.volume);
      }
      report.peak[a] = std::max(report.peak[a], peak.relative());
      report.volume[a] = std::max(report.volume[a], volume.relative());
    }
  }
  return report;
}

ErrorReport measure_error(const ReducedModel& reduced, std::shared_ptr<const FullOrderModel> full,
                          const ValidationSettings& settings, const Progress& progress) {
  return measure_error(reduced, validation_run(std::move(full), reduced.discretization,
                                               reduced.period, settings, progress));
}

}  // namespace photocoag
