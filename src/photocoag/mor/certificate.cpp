#include "photocoag/mor/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "photocoag/core/error.hpp"
#include "photocoag/mor/full_impulse.hpp"
#include "photocoag/mor/majorant.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-9;  // of the steady gain: far above the rounding of sums of doubles

std::vector<double> to_vector(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

// How far an output may exceed the linear interpolation between nodes, per cell: on a cell |e -
// interpolant| <= sum over both directions of h^2/8 max |e''|, and the same once more for e''.
VectorXd remainder(const FactorNodes& nodes, const NodeValues& e) {
  const double a = nodes.factor(0);
  VectorXd result =
      a * (nodes.to_cells(e.second_alpha.cwiseAbs()).array() + a * e.fourth_alpha).matrix();
  if (nodes.two_parameters()) {
    const double b = nodes.factor(1);
    result += b * (nodes.to_cells(e.second_beta.cwiseAbs()).array() + b * e.fourth_beta +
                   2.0 * a * e.fourth_mixed)
                      .matrix();
  }
  return result;
}

// `full` becomes e_k: less the reduced model's part, `power` is lambda_i^(k-1).
void subtract(const OutputExpansion<std::complex<double>>& x, const VectorXcd& power,
              NodeValues& full) {
  const VectorXd magnitude = power.cwiseAbs();
  full.value -= (x.value * power).real();
  full.second_alpha -= (x.second_alpha * power).real();
  full.fourth_alpha += x.fourth.alpha.dot(magnitude);
  if (x.second_beta.size() == 0) return;
  full.second_beta -= (x.second_beta * power).real();
  full.fourth_mixed += x.fourth.mixed.dot(magnitude);
  full.fourth_beta += x.fourth.beta.dot(magnitude);
}

// Sums of one output's e_k over k, at the nodes; finish() takes the largest over beta for each
// alpha.
class OutputSums {
 public:
  OutputSums(const FactorNodes& nodes, std::size_t horizon, std::size_t treatment)
      : nodes_(nodes),
        treatment_(treatment),
        plus_(VectorXd::Zero(nodes.size())),
        minus_(VectorXd::Zero(nodes.size())),
        each_(nodes.alphas().size(), static_cast<Index>(horizon)) {}

  // Adds e_k.
  void add(const NodeValues& e, std::size_t k) {
    const VectorXd slack = nodes_.to_nodes(remainder(nodes_, e));
    plus_ += e.value.cwiseMax(0.0) + slack;
    minus_ += (-e.value).cwiseMax(0.0) + slack;
    each_.col(static_cast<Index>(k - 1)) = nodes_.over_beta(e.value.cwiseAbs() + slack);
    if (k == treatment_) in_treatment_ = plus_.cwiseMax(minus_);
  }

  // The tail beyond the horizon: its sum and its first value.
  void add_tail(double sum, double first) {
    plus_.array() += sum;
    minus_.array() += sum;
    tail_ = sum;
    if (in_treatment_.size() == 0) in_treatment_ = plus_.cwiseMax(minus_);  // horizon is shorter
    first_beyond_ = first;
  }

  // `gain`: the full model's steady gain at the nodes, `gain_between`: at least so much in each
  // cell; `norm`: what the output is divided by at the lowest beta, falling bounds need its smaller
  // end.
  OutputCertificate finish(const VectorXd& gain, const VectorXd& gain_between, const VectorXd& norm,
                           const std::vector<double>& decay) {
    const VectorXd rounding = kRounding * gain;
    const VectorXd bound = plus_.cwiseMax(minus_) + rounding;
    const VectorXd sum = each_.rowwise().sum() + VectorXd::Constant(each_.rows(), tail_) +
                         nodes_.over_beta(rounding);
    // Shape of the majorant: every node's error in units of its own sum.
    const MatrixXd shape = sum.cwiseInverse().asDiagonal() * each_;
    const VectorXd envelope = shape.colwise().maxCoeff();
    const double last = first_beyond_ / sum.minCoeff();
    OutputCertificate out;
    out.majorant = exponential_majorant(to_vector(envelope), decay, last);
    VectorXd scale = VectorXd::Zero(each_.rows());
    for (Index k = 0; k < each_.cols(); ++k) {
      const double value = majorant_value(out.majorant, decay, static_cast<double>(k + 1));
      if (value > 0.0) scale = scale.cwiseMax(each_.col(k) / value);
    }
    if (first_beyond_ > 0.0) {
      const double beyond = static_cast<double>(each_.cols()) + 1.0;
      scale = scale.cwiseMax(first_beyond_ / (out.majorant[0] * std::pow(decay[0], beyond - 1.0)));
    }
    scale *= 1.0 + kRounding;
    const auto relative = [&](const VectorXd& values) {
      const VectorXd per_cell = nodes_.to_cells(values).cwiseQuotient(gain_between);
      return to_vector(nodes_.over_beta(nodes_.to_nodes(per_cell)));
    };
    const VectorXd in_treatment = in_treatment_ + rounding;
    out.relative = relative(bound);
    out.treatment_relative = relative(in_treatment);
    out.bound = to_vector(divided(nodes_.over_beta(bound), norm));
    out.treatment_bound = to_vector(divided(nodes_.over_beta(in_treatment), norm));
    out.sum = to_vector(divided(sum, norm));
    out.scale = to_vector(divided(scale, norm));
    return out;
  }

  double tail() const { return tail_; }

 private:
  // Values per alpha that hold between nodes, divided by a function that grows with alpha.
  VectorXd divided(const VectorXd& values, const VectorXd& norm) const {
    if ((norm.array() == 1.0).all()) return values;
    const FactorNodes line(nodes_.range(), static_cast<int>(values.size()), 1);
    return line.to_nodes(line.to_cells(values).cwiseQuotient(norm.head(norm.size() - 1)));
  }

  const FactorNodes& nodes_;
  std::size_t treatment_;
  VectorXd in_treatment_;
  VectorXd plus_;
  VectorXd minus_;
  MatrixXd each_;  // alphas x horizon: |e_k|, valid between nodes by interpolation
  double tail_ = 0.0;
  double first_beyond_ = 0.0;
};

// 0 for what only the first instant needs; then log-spaced rates from half the slowest, which lies
// above every tail, to about one per period.
std::vector<double> majorant_decays(double slowest) {
  constexpr int kRates = kMaxMajorantTerms - 1;
  constexpr double kFastest = 1.5;
  const double low = -0.5 * std::log(slowest);
  std::vector<double> decay;
  for (int j = 0; j < kRates; ++j) {
    decay.push_back(
        std::exp(-low * std::pow(std::max(kFastest / low, 2.0), double(j) / (kRates - 1))));
  }
  decay.push_back(0.0);
  return decay;
}

}  // namespace

std::string_view why_uncertified(Discretization discretization) noexcept {
  if (discretization == Discretization::kTrBdf2) {
    return "proved only for zero-order hold and implicit Euler";
  }
  return {};
}

ErrorCertificate certify(const ReducedModel& reduced, const FullOrderModel& full,
                         const CertificateSettings& settings) {
  const std::string_view reason = why_uncertified(reduced.discretization);
  if (!reason.empty()) throw Error("no certificate: " + std::string(reason));
  const bool two = reduced.parameters.size() == 2;
  const ParameterRange alpha = reduced.parameters[0];
  const ParameterRange beta = two ? reduced.parameters[1] : ParameterRange{};
  const FactorNodes nodes({{alpha.min, beta.min}, {alpha.max, beta.max}},
                          two ? settings.nodes_beside_beta : settings.nodes,
                          two ? settings.choroid_nodes : 1);
  const ReducedExpansion expansion = expand_reduced(reduced, nodes);
  const VectorXd magnitude = expansion.decay.cwiseAbs();
  const double slowest =
      std::max(slowest_decay(full, reduced.discretization, reduced.period), magnitude.maxCoeff());
  const double wanted = std::ceil(std::log(settings.remaining) / std::log(slowest));
  const auto horizon =
      static_cast<std::size_t>(std::clamp(wanted, 1.0, static_cast<double>(settings.max_horizon)));
  FullImpulse impulse(full, reduced.discretization, reduced.period, nodes, horizon);

  const double periods = std::max(1.0, std::round(settings.treatment / reduced.period));
  const auto treatment = static_cast<std::size_t>(periods);
  OutputSums peak(nodes, horizon, treatment);
  OutputSums volume(nodes, horizon, treatment);
  VectorXcd power = VectorXcd::Ones(expansion.decay.size());
  for (std::size_t k = 1; k <= horizon; ++k) {
    OutputNodeValues error = impulse.now();
    subtract(expansion.outputs.peak, power, error.peak);
    subtract(expansion.outputs.volume, power, error.volume);
    peak.add(error.peak, k);
    volume.add(error.volume, k);
    power = power.cwiseProduct(expansion.decay).eval();
    impulse.advance();
  }
  // Beyond the horizon the two models are bounded separately, mode by mode. `power` and the impulse
  // are now at k = horizon + 1.
  const VectorXd remaining = power.cwiseAbs();
  const VectorXd remaining_sum = remaining.cwiseQuotient((1.0 - magnitude.array()).matrix());
  const OutputBounds& rest = impulse.rest();
  const OutputBounds& first = impulse.first_beyond();
  const VectorXd& peak_bound = expansion.outputs.peak.bound;
  const VectorXd& volume_bound = expansion.outputs.volume.bound;
  peak.add_tail(rest.peak + peak_bound.dot(remaining_sum), first.peak + peak_bound.dot(remaining));
  volume.add_tail(rest.volume + volume_bound.dot(remaining_sum),
                  first.volume + volume_bound.dot(remaining));

  const auto gain_between = [&nodes](const NodeValues& gain) {
    return VectorXd(nodes.least_in_cells(gain.value) - remainder(nodes, gain));
  };
  const OutputNodeValues& steady = impulse.steady();
  const VectorXd peak_between = gain_between(steady.peak);
  const VectorXd volume_between = gain_between(steady.volume);
  const Index alphas = nodes.alphas().size();
  VectorXd norm = VectorXd::Ones(alphas);
  if (reduced.volume_normalized) {
    for (Index i = 0; i < alphas; ++i) {
      norm[i] = reduced.whole.evaluate(nodes.at(i)).value;
    }
  }
  ErrorCertificate certificate;
  certificate.absorption_factors = to_vector(nodes.alphas());
  certificate.decay = majorant_decays(slowest);
  certificate.treatment_duration = periods * reduced.period;
  certificate.horizon = horizon;
  certificate.tail_relative =
      std::max(peak.tail() / peak_between.minCoeff(), volume.tail() / volume_between.minCoeff());
  certificate.peak =
      peak.finish(steady.peak.value, peak_between, VectorXd::Ones(alphas), certificate.decay);
  certificate.volume = volume.finish(steady.volume.value, volume_between, norm, certificate.decay);
  certificate.validate();
  return certificate;
}

}  // namespace photocoag
