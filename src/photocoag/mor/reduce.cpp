#include "photocoag/mor/reduce.hpp"

#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/mor/bases.hpp"
#include "photocoag/mor/certificate.hpp"
#include "photocoag/mor/parameter_dependence.hpp"
#include "photocoag/mor/project.hpp"
#include "photocoag/mor/refine.hpp"

namespace photocoag {

namespace {

// Training covers a slightly wider range of beta than validation, as for alpha.
constexpr double kTrainingMargin = 1.04;
constexpr int kTrainingChoroids = 4;

}  // namespace

ImpulseSpace reduction_space(const FullOrderModel& full, const ReductionSettings& settings) {
  const ChoroidRange choroid = choroid_range(full.tissue(), settings);
  if (!choroid.free) return impulse_space(full, tensor(log_spaced(0.25, 2.0, 8), {1.0}));
  // The layers that alpha scales and those that beta scales have a shape each, of one factor; only
  // how much light arrives depends on both. So pairs span what the whole grid would.
  constexpr int kPairs = 12;
  constexpr int kChoroids = 6;
  const std::vector<double> alphas = log_spaced(0.25, 2.0, kPairs);
  const std::vector<double> betas = choroid.samples(kChoroids, 1.2);
  std::vector<AbsorptionFactors> pairs;
  for (std::size_t i = 0; i < alphas.size(); ++i) {
    pairs.emplace_back(alphas[i], betas[(5 * i) % kChoroids]);
  }
  return impulse_space(full, pairs);
}

ReducedModel project_model(const FullOrderModel& full, const ImpulseSpace& space,
                           const ReductionSettings& settings, double period,
                           Discretization discretization, Eigen::MatrixXd* trial) {
  settings.validate();
  const ChoroidRange choroid = choroid_range(full.tissue(), settings);
  const std::vector<double> betas = choroid.samples(kTrainingChoroids, kTrainingMargin);
  const ParametricSource source =
      parametric_source(full, settings.dependence(), settings.terms(choroid.free), choroid);
  ReducedModel model;
  Eigen::MatrixXd basis =
      project(full, space, make_bases(full, space, settings.method, settings.order, source, betas),
              source, model);
  if (settings.refined()) {
    // The sum of squares has several minima: search from other projections too.
    double least = refine(full, space, source, period, discretization, model, betas);
    for (const ReductionMethod other : {ReductionMethod::kBalanced, ReductionMethod::kIrka}) {
      if (other == settings.method) continue;
      ReducedModel candidate;
      project(full, space, make_bases(full, space, other, settings.order, source, betas), source,
              candidate);
      const double sum = refine(full, space, source, period, discretization, candidate, betas);
      if (!(sum < least)) continue;
      least = sum;
      model = candidate;
    }
    basis = fitted_trial(full, space, period, discretization, model, betas);
  }
  if (trial != nullptr) *trial = std::move(basis);
  model.tissue = full.tissue();
  if (choroid.free) model.parameters.push_back({.min = choroid.low, .max = choroid.high});
  model.volume_normalized = model.tissue.volume_temperature == VolumeTemperature::kNormalized;
  model.whole = AbsorptionLaw(model.tissue).whole();
  model.method = to_string(settings.method);
  model.refinement = to_string(settings.refined() ? settings.refinement : Refinement::kNone);
  model.parameter_dependence = to_string(settings.dependence());
  model.full_order_states = full.states();
  model.discretize(period, discretization);
  return model;
}

namespace {

// A refined model also fits the slow end of the response, which a short run does not show: its
// error on a short run may be this many times the projection's before the projection is preferred.
constexpr double kMostLoss = 2.0;

// The fit keeps stability, not the signs that verify() asks for, and its sum of squares is not the
// largest error: where the projection is better, it is kept.
ReducedModel trusted_model(const FullOrderModel& full, const ImpulseSpace& space,
                           ReductionSettings settings, double period,
                           Discretization discretization) {
  const ReductionSettings wanted = settings;
  settings.refinement = Refinement::kNone;
  ReducedModel projected = project_model(full, space, settings, period, discretization);
  if (wanted.refined()) {
    ReducedModel refined = project_model(full, space, wanted, period, discretization);
    const std::vector<double> betas =
        choroid_range(full.tissue(), wanted).samples(kTrainingChoroids, kTrainingMargin);
    const auto error = [&](const ReducedModel& model) {
      return response_error(full, space, period, discretization, model, betas);
    };
    try {
      verify(refined);
      if (error(refined) <= kMostLoss * error(projected)) return refined;
    } catch (const Error&) {
    }
  }
  verify(projected);
  return projected;
}

}  // namespace

ReducedModel reduce(std::shared_ptr<const FullOrderModel> full, const ReductionSettings& settings,
                    double period, Discretization discretization, const Progress& progress) {
  settings.validate();
  const auto report = [&progress](std::string_view stage, double fraction) {
    if (progress) progress(stage, fraction);
  };
  report("collecting impulse responses", 0.0);
  const ImpulseSpace space = reduction_space(*full, settings);
  report("choosing the basis", 0.4);
  ReducedModel model = trusted_model(*full, space, settings, period, discretization);
  ValidationSettings validation;
  validation.choroid_factors =
      choroid_range(full->tissue(), settings).samples(kCheckedChoroids, 1.0);
  model.error = measure_error(
      model, full, validation,
      [&report](std::string_view stage, double fraction) { report(stage, 0.5 + 0.2 * fraction); });
  if (why_uncertified(discretization).empty()) {
    report("proving its error bound", 0.7);
    model.certificate = certify(model, *full);
  }
  report("done", 1.0);
  return model;
}

}  // namespace photocoag
