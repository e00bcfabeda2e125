#include "photocoag/mor/uncertain_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/fom/shared_grid.hpp"
#include "photocoag/mor/parameter_dependence.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kModes = 10;
constexpr double kLongest = 4.0;       // s, of the fitted step response: nearly steady
constexpr int kFittedTimes = 72;       // log-spaced from one period on
constexpr int kEyesPerTerm = 4;        // fitted to
constexpr int kCheckedEyes = 200;      // measured on
constexpr std::uint64_t kFitSeed = 1;  // of the eyes fitted to, and measured on
constexpr std::uint64_t kCheckSeed = 2;

// Highest degree that a quantity may have alone. A term is included if the sum of its degrees, each
// over the quantity's own, is at most 1 (plus pairs of the lowest ones).
int degree_of(const UncertainQuantity& quantity) {
  switch (quantity.kind) {
    case QuantityKind::kAbsorptionFactor:
      return 5;
    case QuantityKind::kLayerAbsorption:
      return 4;
    default:
      return 3;
  }
}

std::vector<PolynomialTerm> polynomial_terms(const std::vector<UncertainQuantity>& quantities) {
  struct Open {
    int index;
    std::size_t next;  // quantities that may still be multiplied to it
    double used;
  };
  std::vector<PolynomialTerm> terms;
  std::vector<Open> open = {{0, 0, 0.0}};
  for (std::size_t i = 0; i < open.size(); ++i) {
    const Open from = open[i];
    for (std::size_t q = from.next; q < quantities.size(); ++q) {
      if (quantities[q].is_factor()) continue;
      const int own = degree_of(quantities[q]);
      for (int d = 1; d <= own; ++d) {
        const double used = from.used + static_cast<double>(d) / own;
        if (used > 1.0 + 1e-9) break;
        terms.push_back({from.index, static_cast<int>(q), d});
        open.push_back({static_cast<int>(terms.size()), q + 1, used});
      }
    }
  }
  if (terms.size() >= static_cast<std::size_t>(kMaxPolynomialTerms)) {
    throw Error(ErrorParts{.key = "prior",
                           .problem = "too many quantities of the tissue for one model",
                           .accepted = "at most six of them"});
  }
  return terms;
}

// A point of the box, denser towards the edges, as polynomial least squares requires.
std::vector<double> point_of(const std::vector<UncertainQuantity>& quantities, std::uint64_t seed,
                             std::uint64_t index) {
  std::vector<double> log_q;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const double u = uniform(seed, index * 64 + q, RandomStream::kUncertainFit);
    const double low = std::log(quantities[q].low);
    const double high = std::log(quantities[q].high);
    log_q.push_back(0.5 * (low + high) - 0.5 * (high - low) * std::cos(std::numbers::pi * u));
  }
  return log_q;
}

// The tissue of an eye on the shared grid: the last layer absorbs the differences in depth.
Tissue tissue_at(const Tissue& tissue, const std::vector<UncertainQuantity>& quantities,
                 const std::vector<double>& log_q, double depth) {
  Tissue eye = tissue;
  eye.transmission = 1.0;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    eye = with_quantity(std::move(eye), quantities[q], std::exp(log_q[q]));
  }
  eye.layers.back().thickness += depth - eye.depth();
  return eye;
}

BoundaryRange boundaries(const Tissue& tissue, const std::vector<UncertainQuantity>& quantities) {
  Tissue low = tissue;
  Tissue high = tissue;
  for (const UncertainQuantity& quantity : quantities) {
    low = with_quantity(std::move(low), quantity, quantity.low);
    high = with_quantity(std::move(high), quantity, quantity.high);
  }
  BoundaryRange range{.depth = high.depth(),
                      .spot_low = low.spot_radius,
                      .spot_high = high.spot_radius,
                      .domain_radius = tissue.domain_radius};
  for (std::size_t i = 0; i < low.layers.size(); ++i) {
    range.peak_back += high.layers[i].thickness;
    if (low.layers[i].name == low.peak_layer) break;
    range.peak_front += low.layers[i].thickness;
  }
  return range;
}

double value_at(const std::vector<UncertainQuantity>& quantities, const std::vector<double>& log_q,
                QuantityKind kind) {
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    if (quantities[q].kind == kind) return std::exp(log_q[q]);
  }
  return 1.0;
}

// Response of mode i to a step: (1 - e^(-rate t)) / rate.
MatrixXd mode_responses(const std::vector<double>& rates, const std::vector<double>& times) {
  MatrixXd responses(static_cast<Index>(times.size()), static_cast<Index>(rates.size()));
  for (std::size_t i = 0; i < rates.size(); ++i) {
    for (std::size_t k = 0; k < times.size(); ++k) {
      responses(static_cast<Index>(k), static_cast<Index>(i)) =
          -std::expm1(-rates[i] * times[k]) / rates[i];
    }
  }
  return responses;
}

// The eyes' step responses: one column each.
struct Responses {
  MatrixXd peak;
  MatrixXd volume;
};

Responses respond(const Tissue& tissue, const std::vector<UncertainQuantity>& quantities,
                  const FullOrderModel& standing, const std::vector<std::vector<double>>& points,
                  const std::vector<double>& times) {
  Responses all{MatrixXd(static_cast<Index>(times.size()), static_cast<Index>(points.size())), {}};
  all.volume = all.peak;
  for (std::size_t s = 0; s < points.size(); ++s) {
    const FullOrderModel eye(standing,
                             tissue_at(tissue, quantities, points[s], standing.tissue().depth()));
    const StepResponse response = step_response_of(
        eye, value_at(quantities, points[s], QuantityKind::kAbsorptionFactor), times);
    all.peak.col(static_cast<Index>(s)) = response.peak;
    all.volume.col(static_cast<Index>(s)) = response.volume;
  }
  return all;
}

// Rows of psi at the points: terms + 1 columns.
MatrixXd basis_at(const UncertainModel& model, const std::vector<std::vector<double>>& points) {
  MatrixXd basis(static_cast<Index>(points.size()), static_cast<Index>(model.terms.size()) + 1);
  for (std::size_t s = 0; s < points.size(); ++s) {
    std::vector<double> psi(model.terms.size() + 1, 1.0);
    for (std::size_t t = 0; t < model.terms.size(); ++t) {
      const PolynomialTerm& term = model.terms[t];
      const auto q = static_cast<std::size_t>(term.quantity);
      const double low = std::log(model.quantities[q].low);
      const double high = std::log(model.quantities[q].high);
      const double x = std::clamp((2.0 * points[s][q] - low - high) / (high - low), -1.0, 1.0);
      psi[t + 1] =
          psi[static_cast<std::size_t>(term.parent)] * std::cos(term.degree * std::acos(x));
    }
    basis.row(static_cast<Index>(s)) =
        Eigen::Map<const VectorXd>(psi.data(), basis.cols()).transpose();
  }
  return basis;
}

// The power law nearest to the last values; quantities that are factors get 0.
std::vector<double> exponents(const std::vector<UncertainQuantity>& quantities,
                              const std::vector<std::vector<double>>& points,
                              const VectorXd& last) {
  MatrixXd logs = MatrixXd::Ones(last.size(), static_cast<Index>(quantities.size()) + 1);
  for (Index s = 0; s < last.size(); ++s) {
    for (std::size_t q = 0; q < quantities.size(); ++q) {
      if (quantities[q].is_factor()) continue;
      logs(s, static_cast<Index>(q)) = points[static_cast<std::size_t>(s)][q];
    }
  }
  const VectorXd solution = shortest_least_squares(logs, last.array().log().matrix(), 1e-12);
  std::vector<double> result(quantities.size(), 0.0);
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    if (!quantities[q].is_factor()) result[q] = solution[static_cast<Index>(q)];
  }
  return result;
}

// q^g at the points.
VectorXd power_law(const std::vector<double>& g, const std::vector<std::vector<double>>& points) {
  VectorXd values(static_cast<Index>(points.size()));
  for (std::size_t s = 0; s < points.size(); ++s) {
    double power = 0.0;
    for (std::size_t q = 0; q < g.size(); ++q) power += g[q] * points[s][q];
    values[static_cast<Index>(s)] = std::exp(power);
  }
  return values;
}

// Residues of every eye over its power law, then polynomials through them; both least squares,
// relative to the eye's last value.
MatrixXd fit(const MatrixXd& modes, const MatrixXd& responses, const VectorXd& law,
             const MatrixXd& basis) {
  const VectorXd weight = law.cwiseQuotient(responses.bottomRows(1).transpose());
  const MatrixXd residues = least_squares(modes, responses);  // order x eyes
  const MatrixXd weighted_basis = weight.asDiagonal() * basis;
  const MatrixXd weighted = weight.cwiseQuotient(law).asDiagonal() * residues.transpose();
  return least_squares(weighted_basis, weighted).transpose();
}

double worst_fit(const std::vector<double>& rates, const std::vector<double>& times,
                 const Responses& eyes) {
  const MatrixXd modes = mode_responses(rates, times);
  double worst = 0.0;
  for (const MatrixXd* y : {&eyes.peak, &eyes.volume}) {
    const MatrixXd error = modes * least_squares(modes, *y) - *y;
    for (Index s = 0; s < y->cols(); ++s) {
      worst = std::max(worst, error.col(s).cwiseAbs().maxCoeff() / (*y)(y->rows() - 1, s));
    }
  }
  return worst;
}

// Log-spaced between the ends that fit some eyes best.
std::vector<double> shared_rates(const std::vector<double>& times, const Responses& eyes,
                                 double period) {
  std::vector<double> best;
  double least = std::numeric_limits<double>::infinity();
  for (const double slowest : {0.8, 1.1, 1.5, 2.0, 2.8}) {
    for (const double fastest : {0.7, 1.0, 1.5, 2.2, 3.2, 4.5}) {
      std::vector<double> rates = log_spaced(fastest / period, slowest, kModes);
      const double worst = worst_fit(rates, times, eyes);
      if (!(worst < least)) continue;
      least = worst;
      best = std::move(rates);
    }
  }
  return best;
}

void measure(const MatrixXd& model, const MatrixXd& truth, double& rms, double& largest) {
  double squares = 0.0;
  for (Index s = 0; s < truth.cols(); ++s) {
    const VectorXd error = (model.col(s) - truth.col(s)) / truth(truth.rows() - 1, s);
    squares += error.squaredNorm() / static_cast<double>(error.size());
    largest = std::max(largest, error.cwiseAbs().maxCoeff());
  }
  rms = std::sqrt(squares / static_cast<double>(truth.cols()));
}

}  // namespace

StepResponse step_response_of(const FullOrderModel& eye, double absorption_factor,
                              const std::vector<double>& times) {
  const AbsorptionFactors at{absorption_factor, 1.0};
  const VectorXd source = eye.axial_source(at);
  const VectorXd radial_peak = eye.peak_radial().cwiseProduct(eye.beam());
  const VectorXd radial_volume = eye.beam().cwiseAbs2();
  const OutputWeights weights = eye.output_weights(at);
  const auto impulse = [&](double t) {
    const VectorXd radial = (-t * eye.radial().rates.array()).exp().matrix();
    const VectorXd axial = (-t * eye.axial().rates.array()).exp().matrix();
    return std::array<double, 2>{radial_peak.dot(radial) * weights.peak.dot(axial),
                                 radial_volume.dot(radial) * weights.volume.dot(axial)};
  };
  // Gauss-Legendre, five points, on intervals that double from 0.1 us on: the impulse response is
  // smooth in the logarithm of time.
  constexpr std::array<double, 5> kNode = {-0.9061798459386640, -0.5384693101056831, 0.0,
                                           0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, 5> kWeight = {0.2369268850561891, 0.4786286704993665,
                                             0.5688888888888889, 0.4786286704993665,
                                             0.2369268850561891};
  StepResponse response{VectorXd(static_cast<Index>(times.size())),
                        VectorXd(static_cast<Index>(times.size()))};
  std::array<double, 2> sum{};
  double from = 0.0;
  double to = 1e-7;
  for (std::size_t k = 0; k < times.size(); ++k) {
    while (from < times[k]) {
      to = std::min(from == 0.0 ? 1e-7 : 2.0 * from, times[k]);
      for (std::size_t g = 0; g < kNode.size(); ++g) {
        const std::array<double, 2> h = impulse(0.5 * (from + to) + 0.5 * (to - from) * kNode[g]);
        for (std::size_t o = 0; o < 2; ++o) sum[o] += 0.5 * (to - from) * kWeight[g] * h[o];
      }
      from = to;
    }
    response.peak[static_cast<Index>(k)] = sum[0];
    response.volume[static_cast<Index>(k)] = sum[1];
  }
  return response;
}

UncertainModel fit_uncertain_model(const Tissue& tissue, const GridSettings& grid,
                                   const Belief& belief, double period) {
  belief.validate();
  UncertainModel model;
  model.quantities = belief.quantities;
  model.tissue = tissue;
  model.period = period;
  model.terms = polynomial_terms(belief.quantities);

  const BoundaryRange range = boundaries(tissue, belief.quantities);
  std::vector<double> centre;
  for (const UncertainQuantity& q : belief.quantities) {
    centre.push_back(0.5 * (std::log(q.low) + std::log(q.high)));
  }
  const Tissue middle = tissue_at(tissue, belief.quantities, centre, range.depth);
  const FullOrderModel standing(middle, make_shared_grid(range, grid.min_cells));

  const std::vector<double> times =
      log_spaced(period, std::max(kLongest, 10.0 * period), kFittedTimes);
  const auto points_of = [&](std::uint64_t seed, std::size_t count) {
    std::vector<std::vector<double>> points;
    for (std::size_t s = 0; s < count; ++s) {
      points.push_back(point_of(belief.quantities, seed, s));
    }
    return points;
  };
  const auto points = points_of(kFitSeed, kEyesPerTerm * (model.terms.size() + 1));
  const Responses eyes = respond(tissue, belief.quantities, standing, points, times);
  const Responses some{eyes.peak.leftCols(std::min<Index>(24, eyes.peak.cols())),
                       eyes.volume.leftCols(std::min<Index>(24, eyes.peak.cols()))};
  model.rates = shared_rates(times, some, period);
  const MatrixXd modes = mode_responses(model.rates, times);
  const MatrixXd basis = basis_at(model, points);
  const auto fit_output = [&](const MatrixXd& responses, std::vector<double>& g) {
    g = exponents(belief.quantities, points, responses.bottomRows(1).transpose());
    return fit(modes, responses, power_law(g, points), basis);
  };
  model.peak = fit_output(eyes.peak, model.peak_exponents);
  model.volume = fit_output(eyes.volume, model.volume_exponents);

  const auto checked = points_of(kCheckSeed, kCheckedEyes);
  const Responses truth = respond(tissue, belief.quantities, standing, checked, times);
  const MatrixXd psi = basis_at(model, checked).transpose();
  const auto model_of = [&](const MatrixXd& coefficients, const std::vector<double>& g) {
    return MatrixXd(modes * coefficients * psi * power_law(g, checked).asDiagonal());
  };
  measure(model_of(model.peak, model.peak_exponents), truth.peak, model.peak_error_rms,
          model.peak_error_max);
  measure(model_of(model.volume, model.volume_exponents), truth.volume, model.volume_error_rms,
          model.volume_error_max);
  for (std::size_t q = 0; q < model.quantities.size(); ++q) {
    if (model.quantities[q].kind != QuantityKind::kTransmission) continue;
    model.peak_exponents[q] = model.volume_exponents[q] = 1.0;
  }
  model.validate();
  return model;
}

}  // namespace photocoag
