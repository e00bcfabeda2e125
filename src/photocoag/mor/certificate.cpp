#include "photocoag/mor/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "photocoag/core/error.hpp"
#include "photocoag/mor/impulse_error.hpp"
#include "photocoag/mor/majorant.hpp"
#include "photocoag/mor/pulse_response.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-9;  // of the steady gain: far above what sums of doubles lose

// Largest entry of the one or two intervals next to each node: piecewise linear interpolation of
// the result is then above the interval's value everywhere in it.
VectorXd at_nodes(const VectorXd& per_interval) {
  const Index n = per_interval.size() + 1;
  VectorXd result(n);
  for (Index i = 0; i < n; ++i) {
    result[i] =
        std::max(per_interval[std::max<Index>(i - 1, 0)], per_interval[std::min<Index>(i, n - 2)]);
  }
  return result;
}

VectorXd larger_of_neighbours(const VectorXd& at_node) {
  const Index n = at_node.size();
  return at_node.head(n - 1).cwiseMax(at_node.tail(n - 1));
}

std::vector<double> to_vector(const VectorXd& v) { return {v.data(), v.data() + v.size()}; }

// Sums of one output's e_k over k, at the nodes of alpha.
class OutputSums {
 public:
  OutputSums(const OutputExpansion& expansion, double spacing, std::size_t horizon,
             std::size_t treatment)
      : expansion_(expansion),
        treatment_(treatment),
        factor_(spacing * spacing / 8.0),
        nodes_(expansion.weight.rows()),
        plus_(VectorXd::Zero(nodes_)),
        minus_(VectorXd::Zero(nodes_)),
        each_(nodes_, static_cast<Index>(horizon)) {}

  // Adds e_k; the profiles' first `active` entries are not zero, `power` is lambda_i^(k-1).
  void add(const VectorXd& profile, const VectorXd& magnitude, Index active, const VectorXcd& power,
           std::size_t k) {
    const OutputExpansion& x = expansion_;
    const auto p = profile.head(active);
    const VectorXd error = x.weight.leftCols(active) * p - (x.coefficient * power).real();
    const VectorXd second =
        x.weight_second.leftCols(active) * p - (x.coefficient_second * power).real();
    const double fourth = x.weight_fourth.head(active).dot(magnitude.head(active)) +
                          x.coefficient_fourth.dot(power.cwiseAbs());
    // On an interval |e - linear interpolant| <= h^2/8 max |e''|, and the same once more for e''.
    const VectorXd remainder =
        factor_ * (larger_of_neighbours(second.cwiseAbs()).array() + factor_ * fourth).matrix();
    const VectorXd slack = at_nodes(remainder);
    plus_ += error.cwiseMax(0.0) + slack;
    minus_ += (-error).cwiseMax(0.0) + slack;
    each_.col(static_cast<Index>(k - 1)) = error.cwiseAbs() + slack;
    if (k == treatment_) in_treatment_ = plus_.cwiseMax(minus_);
  }

  // What comes after the horizon: in sum, and at its first instant.
  void add_tail(double sum, double first) {
    plus_.array() += sum;
    minus_.array() += sum;
    tail_ = sum;
    if (in_treatment_.size() == 0) in_treatment_ = plus_.cwiseMax(minus_);  // horizon is shorter
    first_beyond_ = first;
  }

  // `gain`: the full model's steady gain at the nodes, `gain_between`: at least so much between
  // them; `norm`: what the output is divided by, falling bounds need its smaller end.
  OutputCertificate finish(const VectorXd& gain, const VectorXd& gain_between, const VectorXd& norm,
                           const std::vector<double>& decay) {
    const VectorXd rounding = kRounding * gain;
    const VectorXd bound = plus_.cwiseMax(minus_) + rounding;
    const VectorXd sum = each_.rowwise().sum() + VectorXd::Constant(nodes_, tail_) + rounding;
    // Shape of the majorant: every node's error in units of its own sum.
    const MatrixXd shape = sum.cwiseInverse().asDiagonal() * each_;
    const VectorXd envelope = shape.colwise().maxCoeff();
    const double last = first_beyond_ / sum.minCoeff();
    OutputCertificate out;
    out.majorant = exponential_majorant(to_vector(envelope), decay, last);
    VectorXd scale = VectorXd::Zero(nodes_);
    for (Index k = 0; k < each_.cols(); ++k) {
      const double value = majorant_value(out.majorant, decay, static_cast<double>(k + 1));
      if (value > 0.0) scale = scale.cwiseMax(each_.col(k) / value);
    }
    if (first_beyond_ > 0.0) {
      const double beyond = static_cast<double>(each_.cols()) + 1.0;
      scale = scale.cwiseMax(first_beyond_ / (out.majorant[0] * std::pow(decay[0], beyond - 1.0)));
    }
    scale *= 1.0 + kRounding;
    const auto relative = [&gain_between](const VectorXd& values) {
      return to_vector(at_nodes(larger_of_neighbours(values).cwiseQuotient(gain_between)));
    };
    const VectorXd in_treatment = in_treatment_ + rounding;
    out.relative = relative(bound);
    out.treatment_relative = relative(in_treatment);
    out.bound = to_vector(divided(bound, norm));
    out.treatment_bound = to_vector(divided(in_treatment, norm));
    out.sum = to_vector(divided(sum, norm));
    out.scale = to_vector(divided(scale, norm));
    return out;
  }

  double tail() const { return tail_; }

 private:
  // Values that hold between nodes, divided by a function that grows with alpha.
  static VectorXd divided(const VectorXd& values, const VectorXd& norm) {
    if ((norm.array() == 1.0).all()) return values;
    return at_nodes(larger_of_neighbours(values).cwiseQuotient(norm.head(norm.size() - 1)));
  }

  const OutputExpansion& expansion_;
  std::size_t treatment_;
  VectorXd in_treatment_;
  double factor_;
  Index nodes_;
  VectorXd plus_;
  VectorXd minus_;
  MatrixXd each_;  // nodes x horizon: |e_k|, valid between nodes by interpolation
  double tail_ = 0.0;
  double first_beyond_ = 0.0;
};

// Steady gain at the nodes and, from below, in the intervals between them.
struct SteadyGain {
  VectorXd node;
  VectorXd between;
};

SteadyGain steady_gain(const OutputExpansion& x, const VectorXd& profile, const VectorXd& magnitude,
                       double spacing) {
  const double h = spacing * spacing / 8.0;
  const VectorXd gain = x.weight * profile;
  const VectorXd second = (x.weight_second * profile).cwiseAbs();
  const VectorXd remainder =
      h * (larger_of_neighbours(second).array() + h * x.weight_fourth.dot(magnitude)).matrix();
  const Index n = gain.size();
  return {gain, gain.head(n - 1).cwiseMin(gain.tail(n - 1)) - remainder};
}

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

std::string_view why_uncertified(const FullOrderModel& full,
                                 Discretization discretization) noexcept {
  if (full.tissue().two_parameters()) {
    return "proved only for alpha, not over a range of beta as well";
  }
  if (!full.separable()) {
    return "proved only where all layers have the same conductivity and heat capacity";
  }
  if (discretization == Discretization::kTrBdf2) {
    return "proved only for zero-order hold and implicit Euler";
  }
  return {};
}

ErrorCertificate certify(const ReducedModel& reduced, const FullOrderModel& full,
                         const CertificateSettings& settings) {
  const std::string_view reason = why_uncertified(full, reduced.discretization);
  if (!reason.empty()) throw Error("no certificate: " + std::string(reason));
  const VectorXd nodes =
      VectorXd::LinSpaced(settings.nodes, reduced.absorption_min, reduced.absorption_max);
  const double spacing = nodes[1] - nodes[0];
  const ErrorExpansion expansion = expand_error(reduced, full, nodes);
  PulseResponse pulse(full, reduced.discretization, reduced.period);
  const VectorXd magnitude = expansion.decay.cwiseAbs();
  const double slowest = std::max(pulse.slowest_decay(), magnitude.maxCoeff());
  const double wanted = std::ceil(std::log(settings.remaining) / std::log(slowest));
  const auto horizon =
      static_cast<std::size_t>(std::clamp(wanted, 1.0, static_cast<double>(settings.max_horizon)));

  const double periods = std::max(1.0, std::round(settings.treatment / reduced.period));
  const auto treatment = static_cast<std::size_t>(periods);
  OutputSums peak(expansion.peak, spacing, horizon, treatment);
  OutputSums volume(expansion.volume, spacing, horizon, treatment);
  VectorXcd power = VectorXcd::Ones(expansion.decay.size());
  for (std::size_t k = 1; k <= horizon; ++k) {
    const AxialProfiles& now = pulse.profiles();
    peak.add(now.axis, now.axis_magnitude, pulse.active(), power, k);
    volume.add(now.spot, now.spot, pulse.active(), power, k);
    power = power.cwiseProduct(expansion.decay).eval();
    pulse.advance();
  }
  // Beyond the horizon both models are bounded apart, mode by mode. `power` and the pulse are now
  // at k = horizon + 1.
  const AxialProfiles rest = pulse.sum_after(static_cast<double>(horizon));
  const AxialProfiles& first = pulse.profiles();
  const VectorXd remaining = power.cwiseAbs();
  const VectorXd remaining_sum = remaining.cwiseQuotient((1.0 - magnitude.array()).matrix());
  const auto bound = [](const OutputExpansion& x, const VectorXd& full_part,
                        const VectorXd& reduced_part) {
    return x.weight_bound.dot(full_part) + x.coefficient_bound.dot(reduced_part);
  };
  peak.add_tail(bound(expansion.peak, rest.axis_magnitude, remaining_sum),
                bound(expansion.peak, first.axis_magnitude, remaining));
  volume.add_tail(bound(expansion.volume, rest.spot, remaining_sum),
                  bound(expansion.volume, first.spot, remaining));

  const AxialProfiles steady = pulse.sum_after(0.0);
  const SteadyGain peak_gain =
      steady_gain(expansion.peak, steady.axis, steady.axis_magnitude, spacing);
  const SteadyGain volume_gain = steady_gain(expansion.volume, steady.spot, steady.spot, spacing);
  VectorXd norm = VectorXd::Ones(nodes.size());
  if (reduced.volume_normalized) {
    for (Index i = 0; i < nodes.size(); ++i) norm[i] = reduced.whole.evaluate(nodes[i]).value;
  }
  ErrorCertificate certificate;
  certificate.absorption_factors = to_vector(nodes);
  certificate.decay = majorant_decays(slowest);
  certificate.treatment_duration = periods * reduced.period;
  certificate.horizon = horizon;
  certificate.tail_relative = std::max(peak.tail() / peak_gain.between.minCoeff(),
                                       volume.tail() / volume_gain.between.minCoeff());
  certificate.peak = peak.finish(peak_gain.node, peak_gain.between, VectorXd::Ones(nodes.size()),
                                 certificate.decay);
  certificate.volume =
      volume.finish(volume_gain.node, volume_gain.between, norm, certificate.decay);
  certificate.validate();
  return certificate;
}

}  // namespace photocoag
