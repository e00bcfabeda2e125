#include "photocoag/crosscheck/lags.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/crosscheck/axial.hpp"
#include "photocoag/crosscheck/radial.hpp"

namespace photocoag::crosscheck {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostRates = 120;   // 1.35^120 = 4e15
constexpr double kEarliest = 1.0 / 32.0;  // of a period: from here on the responses are accurate

// Bounds of the rates with which the tissue's heat decays, 1/s: nothing is slower.
double slowest_rate(const Tissue& tissue) {
  double diffusivity = std::numeric_limits<double>::infinity();
  double perfusion = diffusivity;
  for (const Layer& layer : tissue.layers) {
    const ThermalData data = tissue.thermal(layer);
    diffusivity = std::min(diffusivity, data.conductivity / data.volumetric_heat_capacity);
    perfusion = std::min(perfusion, data.perfusion / data.volumetric_heat_capacity);
  }
  const double radial = 2.404825557695773 / tissue.domain_radius;
  const double axial = kPi / tissue.depth();
  return diffusivity * (radial * radial + axial * axial) + perfusion;
}

// From low to high, factors of at most `step` apart, at least four.
std::vector<double> geometric(double low, double high, double step) {
  const double intervals = std::max(3.0, std::ceil(std::log(high / low) / std::log(step)));
  std::vector<double> values;
  for (double i = 0.0; i <= intervals; ++i) {
    values.push_back(low * std::pow(high / low, i / intervals));
  }
  return values;
}

/// All wanted sources are combinations of a few: source j = sum_a basis_a share(a, j).
struct FewSources {
  Sources basis;
  Eigen::MatrixXd share;
};

FewSources few_sources(const Tissue& tissue, const DepthElements& elements,
                       std::span<const AbsorptionFactors> at) {
  const auto nodes = static_cast<Eigen::Index>(elements.nodes());
  Eigen::MatrixXd loads(nodes, static_cast<Eigen::Index>(at.size()));
  for (std::size_t j = 0; j < at.size(); ++j) {
    const std::vector<double> load = elements.load(tissue, at[j]);
    loads.col(static_cast<Eigen::Index>(j)) = Eigen::Map<const Eigen::VectorXd>(load.data(), nodes);
  }
  const Eigen::MatrixXd q = column_basis(loads, 1e-6);
  const Eigen::Index rank = q.cols();
  FewSources few;
  few.basis.count = static_cast<std::size_t>(rank);
  few.share = q.transpose() * loads;
  few.basis.load.resize(static_cast<std::size_t>(nodes * rank));
  Eigen::Map<Eigen::MatrixXd>(few.basis.load.data(), rank, nodes) = q.transpose();
  return few;
}

/// Step responses, K/W: a row per time and one for the steady state, a column per absorption.
struct StepResponses {
  std::vector<double> times;
  Eigen::MatrixXd peak;
  Eigen::MatrixXd volume;
};

StepResponses step_responses(const Tissue& tissue, std::span<const AbsorptionFactors> at,
                             double period) {
  const DepthElements elements(tissue);
  const FewSources few = few_sources(tissue, elements, at);
  const RadialTerms terms = radial_terms(tissue);
  const RadialTerms sums =
      on_nodes(terms, geometric(terms.rate.front(), terms.rate.back(), std::exp(0.4)));
  StepResponses responses;
  const double slowest = slowest_rate(tissue);
  responses.times = geometric(kEarliest * period, std::max(8.0 / slowest, 4.0 * period), 1.35);
  const std::size_t rows = responses.times.size() + 1;
  const std::size_t count = few.basis.count;
  StepSamples samples{std::vector<double>(rows * count), std::vector<double>(rows * count * count)};
  elements.add_steps(sums, few.basis, responses.times, samples);
  const auto wanted = static_cast<Eigen::Index>(at.size());
  const auto size = static_cast<Eigen::Index>(count);
  responses.peak.resize(static_cast<Eigen::Index>(rows), wanted);
  responses.volume.resize(static_cast<Eigen::Index>(rows), wanted);
  for (std::size_t t = 0; t < rows; ++t) {
    const Eigen::Map<const Eigen::RowVectorXd> peak(&samples.peak[t * count], size);
    const Eigen::Map<const Eigen::MatrixXd> gram(&samples.gram[t * count * count], size, size);
    const auto row = static_cast<Eigen::Index>(t);
    responses.peak.row(row) = tissue.transmission * peak * few.share;
    for (Eigen::Index j = 0; j < wanted; ++j) {
      const double norm = tissue.volume_temperature == VolumeTemperature::kNormalized
                              ? absorbed_fraction(tissue, at[static_cast<std::size_t>(j)])
                              : 1.0;
      responses.volume(row, j) =
          tissue.transmission / norm * few.share.col(j).dot(gram * few.share.col(j));
    }
  }
  return responses;
}

}  // namespace

LagSums tissue_lags(const Tissue& tissue, std::span<const AbsorptionFactors> at, double period) {
  tissue.validate();
  const StepResponses responses = step_responses(tissue, at, period);
  LagSums lags;
  lags.rate = geometric(0.9 * slowest_rate(tissue), 2.0 / (kEarliest * period), 1.35);
  const auto rows = responses.peak.rows();
  // Beyond double precision or not finite: not for a decomposition.
  if (lags.rate.size() > kMostRates || !responses.peak.allFinite() ||
      !responses.volume.allFinite()) {
    throw Error(ErrorParts{
        .key = "tissue",
        .problem = "its heat cannot be computed a second time",
        .found = std::to_string(lags.rate.size()) + " time constants",
        .accepted = "at most " + std::to_string(kMostRates) + ", from slowest to fastest"});
  }
  const auto columns = static_cast<Eigen::Index>(lags.rate.size());
  // Least squares, each time weighed by one over a typical response there.
  Eigen::MatrixXd design(rows, columns);
  Eigen::VectorXd scale(rows);
  for (Eigen::Index t = 0; t < rows; ++t) {
    scale[t] = 1.0 / responses.peak.row(t).mean();
    for (Eigen::Index i = 0; i < columns; ++i) {
      const double rate = lags.rate[static_cast<std::size_t>(i)];
      const double gone =
          t + 1 == rows ? 1.0 : -std::expm1(-rate * responses.times[static_cast<std::size_t>(t)]);
      design(t, i) = scale[t] * gone;
    }
  }
  const Svd<double> factors = large_svd(design);
  const auto fit = [&](const Eigen::MatrixXd& response) {
    const Eigen::MatrixXd right = scale.asDiagonal() * response;
    const Eigen::VectorXd& values = factors.values;
    const Eigen::VectorXd damped =
        values.array() / (values.array().square() + 1e-14 * values[0] * values[0]);
    Eigen::MatrixXd weights = factors.V * damped.asDiagonal() * (factors.U.transpose() * right);
    const Eigen::MatrixXd off = design * weights - right;
    for (Eigen::Index t = 0; t < rows; ++t) {
      if (t + 1 < rows && responses.times[static_cast<std::size_t>(t)] < 0.99 * period) continue;
      for (Eigen::Index j = 0; j < off.cols(); ++j) {
        lags.fit_error = std::max(lags.fit_error, std::abs(off(t, j) / right(t, j)));
      }
    }
    return weights;
  };
  const Eigen::MatrixXd peak = fit(responses.peak);
  const Eigen::MatrixXd volume = fit(responses.volume);
  for (Eigen::Index j = 0; j < peak.cols(); ++j) {
    lags.at.push_back(
        {{peak.col(j).begin(), peak.col(j).end()}, {volume.col(j).begin(), volume.col(j).end()}});
  }
  return lags;
}

namespace {

/// A row per number of periods (1, 2, … and, last, the steady state) and a column per lag: 1 -
/// decay^k.
Eigen::MatrixXd gains_of(const std::vector<double>& decay, const std::vector<double>& periods) {
  Eigen::MatrixXd gains(static_cast<Eigen::Index>(periods.size()) + 1,
                        static_cast<Eigen::Index>(decay.size()));
  for (Eigen::Index i = 0; i < gains.cols(); ++i) {
    const std::vector<double> one = {decay[static_cast<std::size_t>(i)]};
    for (Eigen::Index k = 0; k + 1 < gains.rows(); ++k) {
      gains(k, i) = step_response({1.0}, one, periods[static_cast<std::size_t>(k)]);
    }
    gains(gains.rows() - 1, i) = 1.0;
  }
  return gains;
}

std::vector<double> decays_of(const std::vector<double>& rates, Discretization scheme,
                              double period) {
  std::vector<double> decays;
  for (const double rate : rates) decays.push_back(decay_of(scheme, rate, period));
  return decays;
}

// Largest effect of a step-response error under powers from 0 to 1 W: the sum of all its rises or
// of all its falls, whichever is larger.
double worst_of(const Eigen::VectorXd& step_error) {
  double rises = 0.0;
  double falls = 0.0;
  double before = 0.0;
  for (const double error : step_error) {
    rises += std::max(0.0, error - before);
    falls += std::max(0.0, before - error);
    before = error;
  }
  return std::max(rises, falls);
}

}  // namespace

FewLags few_lags(const LagSums& lags, std::size_t count, Discretization scheme, double period) {
  std::vector<double> periods;
  for (double k = 1.0; k * period * lags.rate.front() < 12.0;) {
    periods.push_back(k);
    k = std::max(k + 1.0, std::floor(1.12 * k));
  }
  const double fastest = 4.0 / period;
  std::vector<double> rates(count);
  for (std::size_t i = 0; i < count; ++i) {
    rates[i] =
        lags.rate.front() * std::pow(fastest / lags.rate.front(),
                                     static_cast<double>(i) / static_cast<double>(count - 1));
  }
  FewLags few{.decay = decays_of(rates, scheme, period), .at = lags.at};
  const Eigen::MatrixXd many = gains_of(decays_of(lags.rate, scheme, period), periods);
  const Eigen::MatrixXd gains = gains_of(few.decay, periods);
  const auto fit = [&](std::vector<double> LagWeights::*output) {
    Eigen::MatrixXd weights(many.cols(), static_cast<Eigen::Index>(lags.at.size()));
    for (Eigen::Index j = 0; j < weights.cols(); ++j) {
      const std::vector<double>& own = lags.at[static_cast<std::size_t>(j)].*output;
      weights.col(j) = Eigen::Map<const Eigen::VectorXd>(own.data(), weights.rows());
    }
    const Eigen::MatrixXd response = many * weights;
    const Eigen::VectorXd scale = response.rowwise().mean().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * gains;
    const Eigen::MatrixXd fitted =
        least_squares(scaled, Eigen::MatrixXd(scale.asDiagonal() * response));
    const Eigen::MatrixXd error = gains * fitted - response;
    double worst = 0.0;
    for (Eigen::Index j = 0; j < weights.cols(); ++j) {
      worst = std::max(worst, worst_of(error.col(j)));
      std::vector<double>& own = few.at[static_cast<std::size_t>(j)].*output;
      own.resize(count);
      for (std::size_t i = 0; i < count; ++i) {
        own[i] = fitted(static_cast<Eigen::Index>(i), j) * (1.0 - few.decay[i]);
      }
    }
    return worst;
  };
  few.peak_error = fit(&LagWeights::peak);
  few.volume_error = fit(&LagWeights::volume);
  return few;
}

double decay_of(Discretization scheme, double rate, double period) {
  const double x = rate * period;
  switch (scheme) {
    case Discretization::kZeroOrderHold:
      return std::exp(-x);
    case Discretization::kImplicitEuler:
      return 1.0 / (1.0 + x);
    case Discretization::kTrBdf2: {
      // Trapezoidal rule over (2 - sqrt 2) h, backward differences over the rest.
      const double part = 1.0 - std::numbers::sqrt2 / 2.0;
      const double middle = (1.0 - part * x) / (1.0 + part * x);
      const double g = 2.0 * part;
      return (middle / g - (1.0 - g) * (1.0 - g) / g) / ((2.0 - g) + (1.0 - g) * x);
    }
  }
  return 0.0;
}

double step_response(const std::vector<double>& weights, const std::vector<double>& decays,
                     double periods) {
  double sum = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double left = std::pow(std::abs(decays[i]), periods);
    const bool negative = decays[i] < 0.0 && std::fmod(periods, 2.0) == 1.0;
    sum += weights[i] * (1.0 - (negative ? -left : left));
  }
  return sum;
}

}  // namespace photocoag::crosscheck
