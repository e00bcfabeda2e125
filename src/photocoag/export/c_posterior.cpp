#include "photocoag/export/c_posterior.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mpc/chance.hpp"

namespace photocoag {
namespace {

using Values = std::map<std::string, std::string>;

std::string flag(bool value) { return std::to_string(value ? 1 : 0); }

// The factors of a term, from the first on.
std::vector<PolynomialTerm> factors_of(const UncertainModel& model, std::size_t term) {
  std::vector<PolynomialTerm> chain;
  for (std::size_t t = term; t > 0; t = static_cast<std::size_t>(model.terms[t - 1].parent)) {
    chain.insert(chain.begin(), model.terms[t - 1]);
  }
  for (std::size_t i = 0; i < chain.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (chain[i].quantity == chain[j].quantity) {
        throw Error(ErrorParts{.key = "model.file",
                               .problem = "exported C has one polynomial of a quantity in a term",
                               .accepted = "a model made by `photocoag reduce`"});
      }
    }
  }
  return chain;
}

// e^(g' m): deviations from the prior's mean are small numbers.
double at_mean(const std::vector<double>& exponents, const std::vector<double>& mean) {
  return std::exp(std::inner_product(exponents.begin(), exponents.end(), mean.begin(), 0.0));
}

void add_polynomials(const UncertainModel& model, const Belief& prior, const CNumbers& write,
                     Values& out) {
  std::vector<std::string> counts;
  std::vector<std::string> factors;
  std::size_t most = 1;
  int degree = 1;
  for (std::size_t t = 0; t <= model.terms.size(); ++t) {
    const std::vector<PolynomialTerm> chain = factors_of(model, t);
    counts.push_back(std::to_string(chain.size()));
    most = std::max(most, chain.size());
    for (const PolynomialTerm& factor : chain) {
      factors.push_back(fmt::format("{{{}, {}}}", factor.quantity, factor.degree));
      degree = std::max(degree, factor.degree);
    }
  }
  if (factors.empty()) factors.emplace_back("{0, 0}");
  out["polynomials"] = std::to_string(model.terms.size() + 1);
  out["most_factors"] = std::to_string(most);
  out["degree"] = std::to_string(degree);
  out["factor_counts"] = fmt::format("{{{}}}", fmt::join(counts, ", "));
  out["factors"] = fmt::format("{{{}}}", fmt::join(factors, ", "));
  double calibration = 1.0;
  for (std::size_t q = 0; q < prior.quantities.size(); ++q) {
    if (prior.quantities[q].kind == QuantityKind::kCalibration) {
      calibration = std::exp(prior.mean[q]);
    }
  }
  const double peak = at_mean(model.peak_exponents, prior.mean);
  const double volume = calibration * at_mean(model.volume_exponents, prior.mean);
  out["peak_terms"] = write.matrix(Eigen::MatrixXd(peak * model.peak.transpose()));
  out["volume_coefficients"] = write.matrix(Eigen::MatrixXd(volume * model.volume.transpose()));
  out["peak_exponents"] = write.list(model.peak_exponents);
  out["volume_exponents"] = write.list(model.volume_exponents);
}

void add_prior(const UncertainModel& model, const EstimatorSettings& estimator,
               const CNumbers& write, Values& out) {
  const Belief& prior = estimator.prior;
  std::vector<std::string> ranges;
  int calibration = -1;
  bool considered = false;
  for (std::size_t q = 0; q < model.quantities.size(); ++q) {
    const UncertainQuantity& quantity = prior.quantities[q];
    const double low = std::log(quantity.low);
    const double high = std::log(quantity.high);
    const double scale = quantity.is_factor() ? 0.0 : 2.0 / (high - low);
    const double mean = prior.mean[q];
    const double centre = quantity.is_factor() ? 0.0 : (2.0 * mean - low - high) / (high - low);
    ranges.push_back(fmt::format("{{{}, {}, {}, {}, {}}}", write.number(low - mean),
                                 write.number(high - mean), write.number(centre),
                                 write.number(scale), quantity.estimated ? 1 : 0));
    if (quantity.kind == QuantityKind::kCalibration) calibration = static_cast<int>(q);
    considered = considered || !quantity.estimated;
  }
  const double spread = prior.noise_spread;
  out["quantities"] = std::to_string(model.count());
  out["ranges"] = CNumbers::lines(ranges);
  out["calibration"] = std::to_string(calibration);
  out["considered"] = flag(considered);
  out["noise_learned"] = flag(spread > 0.0);
  out["noise"] = write.number(prior.noise > 0.0 ? prior.noise : estimator.measurement_noise);
  out["noise_samples"] = write.number(spread > 0.0 ? 1.0 / (2.0 * spread * spread) : 0.0);
  out["prior_mean"] = write.list(prior.mean);
  out["prior_covariance"] = write.matrix(prior.covariance_matrix());
  const Eigen::MatrixXd information = inverse(prior.covariance_matrix());
  out["prior_information"] = write.matrix(information);
  const std::optional<Eigen::MatrixXd> root = cholesky(information);
  if (!root) throw Error("the prior's covariance is not positive definite");
  out["prior_root"] = write.matrix(Eigen::MatrixXd(root->transpose()));
}

}  // namespace

void add_posterior(const UncertainModel* model, const ControlSettings& control,
                   const EstimatorSettings& estimator, const CNumbers& write, Values& out) {
  const bool chance = control.robust == Robustness::kChance;
  out["posterior"] = flag(model != nullptr);
  out["chance"] = flag(chance);
  out["identification"] =
      std::to_string(std::llround(control.identification_duration / control.period));
  out["identification_power"] = write.number(control.identification_power);
  out["identification_sigma"] = write.number(control.identification_sigma);
  out["kappa"] = write.number(chance ? kept_deviations(control.limit_probability) : 0.0);
  out["estimator_words"] =
      model != nullptr ? "residues over the uncertain quantities, what all samples say of them"
                       : "the reduced model at an absorption factor, extended Kalman filter";
  if (model == nullptr) {
    for (const char* name :
         {"quantities",        "polynomials",      "most_factors",  "degree",
          "calibration",       "considered",       "noise_learned", "noise",
          "noise_samples",     "peak_error",       "gain",          "ranges",
          "factor_counts",     "factors",          "peak_terms",    "volume_coefficients",
          "peak_exponents",    "volume_exponents", "prior_mean",    "prior_covariance",
          "prior_information", "prior_root"}) {
      out[name] = flag(false);
    }
    return;
  }
  if (!model->seen_before.empty()) {
    throw Error(ErrorParts{.key = "photoacoustics.sampling",
                           .problem = "the exported C has no model of single pulses",
                           .found = "\"pulses\"",
                           .accepted = "\"instant\""});
  }
  StateVector decay;
  StateVector gain;
  model->step_of(model->period, decay, gain);
  out["gain"] = write.list(gain);
  out["peak_error"] = write.number(model->peak_error_rms);
  add_polynomials(*model, estimator.prior, write, out);
  add_prior(*model, estimator, write, out);
}

}  // namespace photocoag
