#include "photocoag/run/tissue_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>

#include "photocoag/core/error.hpp"
#include "photocoag/safety/multi_model_observer.hpp"

namespace photocoag {
namespace {

// Alphas at which models are compared, within the estimator's bounds. More than a product of two
// polynomials of kMaxTerms terms has zeros, so an error cannot hide between them.
constexpr double kCheckedLow = 0.3;
constexpr double kCheckedHigh = 1.7;
constexpr int kCheckedAlphas = 29;
constexpr int kCheckedBetas = 5;
static_assert(kCheckedAlphas > 2 * (kMaxTerms - 1));
// Duration of the reduction's own runs, whatever a file states.
constexpr double kLeastRun = 0.4;  // s
constexpr double kTolerance = 0.01;
// Stated errors hold for the duration of a run; beyond it models of few states drift: by up to 3 %
// as observed (10 % of the volume temperature without refinement).
constexpr double kSteadyTolerance = 0.1;
// The grid of the full-order model has an error too: 0.04 % at 80,000 cells, in proportion to the
// area of a cell; 0.9 % observed at 1,000.
constexpr double kGridError = 10.0;  // times one over the cells
constexpr double kGridErrorMax = 0.01;
// A model with a larger stated error is not accepted for the tissue.
constexpr double kStatedErrorMax = 0.25;
// Agreement of the cross-check with the full-order model on the default grid, with margin.
constexpr double kAccuracy = 0.002;

std::vector<double> spread(double low, double high, std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(
        low * std::pow(high / low, static_cast<double>(i) /
                                       static_cast<double>(std::max<std::size_t>(count, 2) - 1)));
  }
  return values;
}

std::vector<AbsorptionFactors> pairs(const std::vector<double>& alphas,
                                     const std::vector<double>& betas) {
  std::vector<AbsorptionFactors> at;
  for (const double beta : betas) {
    for (const double alpha : alphas) at.push_back({alpha, beta});
  }
  return at;
}

std::vector<double> within(double low, double high, double least, double most, std::size_t count) {
  const double from = std::clamp(low, least, most);
  return spread(from, std::clamp(high, least, most), count);
}

std::vector<AbsorptionFactors> checked_absorptions(const EstimatorSettings& estimator) {
  const std::vector<double> alphas = within(kCheckedLow, kCheckedHigh, estimator.absorption_min,
                                            estimator.absorption_max, kCheckedAlphas);
  if (estimator.unknowns != Unknowns::kRpeAndChoroid) {
    return pairs(alphas, {estimator.choroid_initial});
  }
  const ReductionSettings defaults;
  return pairs(alphas, within(defaults.choroid_min, defaults.choroid_max, estimator.choroid_min,
                              estimator.choroid_max, kCheckedBetas));
}

/// One output at one absorption: model and cross-check at k = 1, 2, …
struct Compared {
  std::vector<double> model;
  std::vector<double> reference;
  double model_steady = 0.0;
  double reference_steady = 0.0;
};

struct BothOutputs {
  Compared peak;
  Compared volume;
};

BothOutputs responses_of(const ReducedModel& model, AbsorptionFactors at,
                         const crosscheck::LagWeights& reference, const std::vector<double>& rates,
                         std::size_t periods) {
  BothOutputs both;
  ReducedPlant plant(model, at);
  std::vector<double> decay;
  for (const double rate : rates) {
    decay.push_back(crosscheck::decay_of(model.discretization, rate, model.period));
  }
  std::vector<double> left(rates.size(), 1.0);
  for (std::size_t k = 0; k < periods; ++k) {
    plant.step(1.0);
    both.peak.model.push_back(plant.outputs().peak);
    both.volume.model.push_back(plant.outputs().volume);
    double peak = 0.0;
    double volume = 0.0;
    for (std::size_t i = 0; i < rates.size(); ++i) {
      left[i] *= decay[i];
      peak += reference.peak[i] * (1.0 - left[i]);
      volume += reference.volume[i] * (1.0 - left[i]);
    }
    both.peak.reference.push_back(peak);
    both.volume.reference.push_back(volume);
  }
  for (std::size_t i = 0; i < rates.size(); ++i) {
    both.peak.reference_steady += reference.peak[i];
    both.volume.reference_steady += reference.volume[i];
  }
  // (I - A_d)^-1 B_d by squaring: sums of 2^j periods.
  ParametricMatrices matrices;
  model.evaluate(at, matrices);
  Eigen::MatrixXd power = model.A_d;
  Eigen::VectorXd sum = matrices.input;
  for (int j = 0; j < 40; ++j) {
    sum += power * sum;
    power = Eigen::MatrixXd(power * power);
  }
  both.peak.model_steady = Eigen::VectorXd(model.C_peak).dot(sum);
  both.volume.model_steady = Eigen::VectorXd(matrices.volume).dot(sum);
  return both;
}

/// Effect of impulse-response errors under on/off powers of 0 or 1 W, period by period.
struct OnOffError {
  explicit OnOffError(const Compared& compared) : output(compared) {}

  static OnOffError of_all(const Compared& compared) {
    OnOffError error(compared);
    while (error.period < compared.model.size()) error.step();
    return error;
  }

  void step() {
    const double error = output.reference[period] - output.model[period];
    rises += std::max(0.0, error - before);
    falls += std::max(0.0, before - error);
    before = error;
    ++period;
  }
  double largest() const { return std::max(rises, falls); }

  const Compared& output;
  std::size_t period = 0;
  double before = 0.0;
  double rises = 0.0;
  double falls = 0.0;
};

struct Judge {
  const ReducedModel& model;
  const std::string& where;
  double grid;  // relative

  [[noreturn]] void refuse(std::string key, std::string problem, std::string found,
                           std::string accepted) const {
    throw Error(ErrorParts{.where = where,
                           .key = std::move(key),
                           .problem = std::move(problem),
                           .found = std::move(found),
                           .accepted = std::move(accepted)});
  }

  void responses(const char* key, const Compared& output, AbsorptionFactors at,
                 double stated) const {
    const double believed = std::min(stated, kStatedErrorMax);
    constexpr std::size_t kSteady = 0;
    const auto compare = [&](double found, double wanted, double tolerance, double full,
                             std::size_t periods) {
      if (std::abs(found - wanted) <= tolerance * full) return;
      const std::string when =
          periods == kSteady
              ? "for ever"
              : fmt::format("after {:g} ms", 1e3 * model.period * static_cast<double>(periods));
      refuse(key, "the model's response is not that of the tissue",
             fmt::format("{:.2f} K/W {} at alpha = {:.3g}, beta = {:.3g}", found, when, at.alpha,
                         at.beta),
             fmt::format("{:.2f} +- {:.2f} K/W, computed from [tissue]", wanted, tolerance * full));
    };
    for (std::size_t k = 0; k < output.model.size(); ++k) {
      compare(output.model[k], output.reference[k], believed + kTolerance + grid,
              output.reference.back(), k + 1);
    }
    compare(output.model_steady, output.reference_steady, 2.0 * believed + kSteadyTolerance,
            output.reference_steady, kSteady);
  }

  void certificate(const BothOutputs& both, AbsorptionFactors at) const {
    const ErrorCertificate& certificate = *model.certificate;
    const Outputs bound = certificate.bound(at.alpha, 1.0);
    claims("peak.bound_K_per_W", bound.peak, OnOffError::of_all(both.peak), at);
    claims("volume.bound_K_per_W", bound.volume, OnOffError::of_all(both.volume), at);
    ErrorCertificate of_treatment = certificate;
    of_treatment.peak.bound = certificate.peak.treatment_bound;
    of_treatment.volume.bound = certificate.volume.treatment_bound;
    const Outputs treatment = of_treatment.bound(at.alpha, 1.0);
    const double periods = std::round(certificate.treatment_duration / model.period);
    RunningErrorBound running(certificate);
    OnOffError peak(both.peak);
    OnOffError volume(both.volume);
    for (std::size_t k = 1; k <= both.peak.model.size(); ++k) {
      running.step(1.0);
      const Outputs now = running.bound(at.alpha);
      peak.step();
      volume.step();
      claims("peak.scale_K_per_W", now.peak, peak, at);
      claims("volume.scale_K_per_W", now.volume, volume, at);
      if (static_cast<double>(k) > periods) continue;
      claims("peak.treatment_bound_K_per_W", treatment.peak, peak, at);
      claims("volume.treatment_bound_K_per_W", treatment.volume, volume, at);
    }
  }

  /// `found`: the largest error so far under powers from 0 to 1 W.
  void claims(const char* key, double claim, const OnOffError& found, AbsorptionFactors at) const {
    // On/off powers add up the grid's early and late errors.
    const double accuracy = (kAccuracy + 1.5 * grid) * found.output.reference.back();
    if (found.largest() <= claim + accuracy) return;
    refuse(
        fmt::format("certificate.{}", key), "the certificate claims less than the model's error",
        fmt::format("{:.3g} K/W after {:g} ms", claim,
                    1e3 * model.period * static_cast<double>(found.period)),
        fmt::format("at least {:.3g} K/W at alpha = {:.3g}", found.largest() - accuracy, at.alpha));
  }
};

// The observer's beta if it is unknown: estimated, or the absorption of a layer in the prior.
struct UnknownBeta {
  double low = 0.0;
  double high = 0.0;
  Tissue tissue;  // with that layer scaled by beta
};

std::optional<UnknownBeta> unknown_beta(const Tissue& tissue, const EstimatorSettings& estimator) {
  if (estimator.unknowns == Unknowns::kRpeAndChoroid) {
    return UnknownBeta{estimator.choroid_min, estimator.choroid_max, tissue};
  }
  for (const UncertainQuantity& quantity : estimator.prior.quantities) {
    if (quantity.kind != QuantityKind::kLayerAbsorption) continue;
    UnknownBeta beta{.tissue = tissue};
    for (Layer& layer : beta.tissue.layers) {
      if (layer.name != quantity.layer || layer.scaled_by == ScaledBy::kAlpha) continue;
      layer.scaled_by = ScaledBy::kBeta;
      beta.low = quantity.low / layer.absorption;
      beta.high = quantity.high / layer.absorption;
      return beta;
    }
  }
  return {};
}

struct Kept {
  Tissue tissue;
  EstimatorSettings estimator;
  double period;
  std::shared_ptr<const TissueReference> reference;
};

}  // namespace

std::shared_ptr<const TissueReference> tissue_reference(const Tissue& tissue,
                                                        const EstimatorSettings& estimator,
                                                        double period) {
  static std::mutex mutex;
  static std::deque<Kept> kept;
  const std::lock_guard lock(mutex);
  for (const Kept& k : kept) {
    const bool same_bounds = k.estimator.absorption_min == estimator.absorption_min &&
                             k.estimator.absorption_max == estimator.absorption_max &&
                             k.estimator.choroid_min == estimator.choroid_min &&
                             k.estimator.choroid_max == estimator.choroid_max &&
                             k.estimator.choroid_initial == estimator.choroid_initial &&
                             k.estimator.unknowns == estimator.unknowns &&
                             k.estimator.prior == estimator.prior;
    if (same_bounds && k.period == period && k.tissue == tissue) return k.reference;
  }
  auto reference = std::make_shared<TissueReference>();
  const std::optional<UnknownBeta> beta = unknown_beta(tissue, estimator);
  reference->at = pairs(spread(estimator.absorption_min, estimator.absorption_max,
                               beta ? kObserverAbsorptions / 2 : kObserverAbsorptions),
                        beta ? spread(beta->low, beta->high, kObserverChoroids)
                             : std::vector<double>{estimator.choroid_initial});
  reference->observed = reference->at.size();
  for (const AbsorptionFactors at : checked_absorptions(estimator)) reference->at.push_back(at);
  reference->lags = crosscheck::tissue_lags(beta ? beta->tissue : tissue, reference->at, period);
  constexpr std::size_t kKept = 4;
  if (kept.size() == kKept) kept.pop_front();
  kept.push_back({tissue, estimator, period, reference});
  return reference;
}

void check_model(const ReducedModel& model, const Tissue& tissue,
                 const EstimatorSettings& estimator, const std::string& where) {
  const auto reference = tissue_reference(tissue, estimator, model.period);
  const double cells = static_cast<double>(std::max<std::size_t>(model.full_order_states, 1));
  const Judge judge{model, where, std::min(kGridErrorMax, kGridError / cells)};
  // The run of the stated error, within reasonable bounds.
  const double run = std::clamp(model.error.duration, kLeastRun, 1.0) / model.period;
  const auto periods = static_cast<std::size_t>(std::clamp(std::round(run), 8.0, 10'000.0));
  for (std::size_t j = reference->observed; j < reference->at.size(); ++j) {
    const AbsorptionFactors at = reference->at[j];
    const BothOutputs both =
        responses_of(model, at, reference->lags.at[j], reference->lags.rate, periods);
    judge.responses("continuous.C_peak", both.peak, at, model.error.peak_max());
    judge.responses("continuous.C_volume", both.volume, at, model.error.volume_max());
    if (model.certificate) judge.certificate(both, at);
  }
}

}  // namespace photocoag
