#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/parameter_dependence.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/mor/resolvent_basis.hpp"

namespace photocoag {
namespace {

constexpr double kNegligibleDecay = 1e-12;  // as ModalStepper's

// Largest absolute error and largest absolute value of one output for one alpha and beta.
struct Extreme {
  double error = 0.0;
  double value = 0.0;

  void add(double reference, double approximation) {
    error = std::max(error, std::abs(approximation - reference));
    value = std::max(value, std::abs(reference));
  }
  double relative() const { return value > 0.0 ? error / value : 0.0; }
};

// One run of the state serves all absorption factors where the state does not depend on them.
void run_separable(const std::shared_ptr<const FullOrderModel>& full, Discretization discretization,
                   double period, ValidationRun& run, const Progress& progress) {
  std::vector<OutputWeights> weights;
  for (const AbsorptionFactors& at : run.factors) weights.push_back(full->output_weights(at));
  ModalStepper stepper(full, discretization, period);
  for (std::size_t s = 0; s < run.powers.size(); ++s) {
    const std::vector<double>& powers = run.powers[s];
    stepper.reset();
    for (std::size_t k = 0; k < powers.size(); ++k) {
      stepper.step(powers[k]);
      for (const OutputWeights& at : weights) run.outputs[s].push_back(stepper.outputs(at));
      if (progress && k % 50 == 0) {
        const double part = static_cast<double>(k) / static_cast<double>(powers.size());
        progress("measuring its error",
                 (static_cast<double>(s) + part) / static_cast<double>(run.powers.size()));
      }
    }
  }
}

// Step responses to 1 W: period by period, all absorption factors in turn. Everything is linear in
// the source, and a few sources span all: one run for each. After one period of power the tissue
// only cools, which gets cheaper step by step (LayeredStepper); the step response is the running
// sum of the pulse response.
std::vector<Outputs> layered_step_responses(const std::shared_ptr<const FullOrderModel>& full,
                                            Discretization discretization, double period,
                                            const std::vector<AbsorptionFactors>& factors,
                                            std::size_t steps, const Progress& progress) {
  const Eigen::MatrixXd basis = source_basis(*full, factors);
  const auto count = static_cast<Eigen::Index>(factors.size());
  Eigen::MatrixXd share(basis.cols(), count);
  Eigen::MatrixXd weight(basis.rows(), count);
  for (Eigen::Index a = 0; a < count; ++a) {
    weight.col(a) = full->axial_source(factors[static_cast<std::size_t>(a)]);
    share.col(a) = basis.transpose() * weight.col(a);
    weight.col(a) /= full->volume_norm(factors[static_cast<std::size_t>(a)]);
  }
  std::vector<Outputs> responses(steps * factors.size());
  for (Eigen::Index source = 0; source < basis.cols(); ++source) {
    LayeredStepper stepper(full, discretization, period, basis.col(source), kNegligibleDecay);
    for (std::size_t k = 0; k < steps; ++k) {
      stepper.step(k == 0 ? 1.0 : 0.0);
      const Eigen::VectorXd volume = weight.transpose() * stepper.spot_profile();
      for (Eigen::Index a = 0; a < count; ++a) {
        Outputs& sum = responses[k * factors.size() + static_cast<std::size_t>(a)];
        sum.volume += share(source, a) * volume[a];
        sum.peak += share(source, a) * stepper.outputs().peak;
      }
    }
    if (progress) {
      progress("measuring its error",
               static_cast<double>(source + 1) / static_cast<double>(basis.cols()));
    }
  }
  for (std::size_t i = factors.size(); i < responses.size(); ++i) {
    responses[i].volume += responses[i - factors.size()].volume;
    responses[i].peak += responses[i - factors.size()].peak;
  }
  return responses;
}

// A step of power for every change of power.
void run_layered(const std::shared_ptr<const FullOrderModel>& full, Discretization discretization,
                 double period, ValidationRun& run, const Progress& progress) {
  const std::size_t count = run.factors.size();
  std::size_t steps = 0;
  for (const std::vector<double>& powers : run.powers) steps = std::max(steps, powers.size());
  const std::vector<Outputs> responses =
      layered_step_responses(full, discretization, period, run.factors, steps, progress);
  for (std::size_t s = 0; s < run.powers.size(); ++s) {
    const std::vector<double>& powers = run.powers[s];
    std::vector<Outputs>& outputs = run.outputs[s];
    outputs.assign(powers.size() * count, Outputs{});
    for (std::size_t start = 0; start < powers.size(); ++start) {
      const double change = powers[start] - (start == 0 ? 0.0 : powers[start - 1]);
      if (change == 0.0) continue;
      for (std::size_t i = start * count; i < outputs.size(); ++i) {
        outputs[i].volume += change * responses[i - start * count].volume;
        outputs[i].peak += change * responses[i - start * count].peak;
      }
    }
  }
}

std::vector<double> default_alphas(int count) {
  std::vector<double> alphas;
  for (int i = 0; i < count; ++i) alphas.push_back(0.3 + 1.4 * i / (count - 1));
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
  run.two_parameters = full->tissue().two_parameters();
  std::vector<double> betas = settings.choroid_factors;
  if (betas.empty()) betas = choroid_range(full->tissue(), {}).samples(kCheckedChoroids, 1.0);
  run.factors =
      tensor(settings.absorption_factors.empty() ? default_alphas(run.two_parameters ? 15 : 29)
                                                 : settings.absorption_factors,
             betas);
  run.duration = settings.duration;
  run.mean_dwell = settings.mean_dwell;
  run.seed = settings.seed;
  const auto steps =
      static_cast<std::size_t>(std::max(1.0, std::round(settings.duration / period)));
  run.powers = {std::vector<double>(steps, 1.0),
                on_off_power(settings.duration, period, settings.mean_dwell, settings.seed)};
  run.outputs.resize(run.powers.size());
  if (full->separable()) {
    run_separable(full, discretization, period, run, progress);
  } else {
    run_layered(full, discretization, period, run, progress);
  }
  return run;
}

ErrorReport measure_error(const ReducedModel& reduced, const ValidationRun& run) {
  const std::size_t count = run.factors.size();
  ErrorReport report;
  for (const AbsorptionFactors& at : run.factors) {
    report.absorption_factors.push_back(at.alpha);
    if (run.two_parameters) report.choroid_factors.push_back(at.beta);
  }
  report.duration = run.duration;
  report.mean_dwell = run.mean_dwell;
  report.seed = run.seed;
  report.peak.assign(count, 0.0);
  report.volume.assign(count, 0.0);
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t s = 0; s < run.powers.size(); ++s) {
      ReducedPlant plant(reduced, run.factors[a]);
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
