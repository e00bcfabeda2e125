#include <algorithm>
#include <cmath>

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

ErrorReport measure_error(const ReducedModel& reduced, std::shared_ptr<const FullOrderModel> full,
                          const ValidationSettings& settings, const Progress& progress) {
  ErrorReport report;
  report.absorption_factors =
      settings.absorption_factors.empty() ? default_alphas() : settings.absorption_factors;
  report.duration = settings.duration;
  report.mean_dwell = settings.mean_dwell;
  report.seed = settings.seed;
  const std::size_t count = report.absorption_factors.size();
  report.peak.assign(count, 0.0);
  report.volume.assign(count, 0.0);
  std::vector<OutputWeights> weights;
  for (const double alpha : report.absorption_factors)
    weights.push_back(full->output_weights(alpha));

  const auto steps =
      static_cast<std::size_t>(std::max(1.0, std::round(settings.duration / reduced.period)));
  const std::vector<std::vector<double>> signals = {
      std::vector<double>(steps, 1.0),
      on_off_power(settings.duration, reduced.period, settings.mean_dwell, settings.seed)};
  ModalStepper stepper(full, reduced.discretization, reduced.period);
  for (std::size_t s = 0; s < signals.size(); ++s) {
    std::vector<ReducedPlant> plants;
    for (const double alpha : report.absorption_factors) plants.emplace_back(reduced, alpha);
    std::vector<Extreme> peak(count);
    std::vector<Extreme> volume(count);
    stepper.reset();
    for (std::size_t k = 0; k < signals[s].size(); ++k) {
      stepper.step(signals[s][k]);
      for (std::size_t a = 0; a < count; ++a) {
        plants[a].step(signals[s][k]);
        const Outputs reference = stepper.outputs(weights[a]);
        const Outputs approximation = plants[a].outputs();
        peak[a].add(reference.peak, approximation.peak);
        volume[a].add(reference.volume, approximation.volume);
      }
      if (progress && k % 50 == 0) {
        progress(
            "measuring its error",
            (static_cast<double>(s) + static_cast<double>(k) / static_cast<double>(steps)) / 2.0);
      }
    }
    for (std::size_t a = 0; a < count; ++a) {
      report.peak[a] = std::max(report.peak[a], peak[a].relative());
      report.volume[a] = std::max(report.volume[a], volume[a].relative());
    }
  }
  return report;
}

}  // namespace photocoag
