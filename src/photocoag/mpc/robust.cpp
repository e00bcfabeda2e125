#include "photocoag/mpc/robust.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

ErrorCertificate certificate_of(const ReducedModel& model) {
  // A certificate compares two models with the same discretization. Only zero-order hold is that of
  // the eye.
  if (model.discretization != Discretization::kZeroOrderHold) {
    throw Error(ErrorParts{.key = "model.discretization",
                           .problem = "control.robust = \"certified\" does not cover the error of "
                                      "this time scheme",
                           .found = "\"" + std::string(to_string(model.discretization)) + "\"",
                           .accepted = "\"zero-order-hold\", or control.robust = \"none\""});
  }
  if (!model.certificate) {
    throw Error(ErrorParts{.key = "control.robust",
                           .problem = "the reduced model has no proved error bound",
                           .found = "\"certified\"",
                           .accepted = "\"none\", or a model with a certificate: see `photocoag "
                                       "reduce`, which says why there is none"});
  }
  return *model.certificate;
}

}  // namespace

RobustLimit::RobustLimit(const ReducedModel& model, const ControlSettings& settings,
                         AbsorptionFactors most)
    : model_(model),
      certificate_(certificate_of(model)),
      sigmas_(settings.robust_sigma),
      power_max_(settings.power_max),
      most_(most),
      stages_(settings.horizon - 1) {
  settings.validate();
  certificate_.validate();
  const Eigen::Index n = model.order();
  peak_powers_.resize(settings.horizon, n);
  peak_powers_.row(0) = model.C_peak.transpose();
  for (int k = 1; k < settings.horizon; ++k) {
    peak_powers_.row(k) = (peak_powers_.row(k - 1) * model.A_d).eval();
  }
  const std::size_t terms = certificate_.decay.size();
  for (int i = 0; i <= stages_; ++i) {
    for (std::size_t j = 0; j < terms; ++j) {
      majorant_.push_back(certificate_.peak.majorant[j] * std::pow(certificate_.decay[j], i));
    }
  }
  sigma_.setZero(stages_);
  pending_excess_.setZero(n);
  pending_excess_low_.setZero(n);
  input_low_.setZero(n);
  estimated_.setZero(n);
  tightening_.input.setZero(n);
  tightening_.free.setZero(stages_);
  tightening_.impulse.setZero(stages_);
  model_.evaluate(1.0, matrices_);  // gives the matrices their sizes
}

void RobustLimit::observe(double power) noexcept {
  for (std::size_t j = 0; j < certificate_.decay.size(); ++j) {
    applied_[j] = certificate_.decay[j] * applied_[j] + std::max(power, 0.0);
  }
}

double RobustLimit::largest_scale(double low, double high) const noexcept {
  // The scale is linear between nodes: its largest value is at a node or at an end, and the node
  // next to an end is at least as far out.
  const std::vector<double>& nodes = certificate_.absorption_factors;
  const std::vector<double>& scale = certificate_.peak.scale;
  const auto at = [&](double alpha) {
    if (alpha <= nodes.front()) return scale.front();
    for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
      if (alpha <= nodes[i + 1])
        return scale[i] +
               (alpha - nodes[i]) / (nodes[i + 1] - nodes[i]) * (scale[i + 1] - scale[i]);
    }
    return scale.back();
  };
  double largest = std::max(at(low), at(high));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i] > low && nodes[i] < high) largest = std::max(largest, scale[i]);
  }
  return largest;
}

const LimitTightening& RobustLimit::finish(const Absorption& absorption, bool delayed,
                                           double pending) noexcept {
  const auto highest = [this](double mean, double sigma, double most) {
    return std::max(mean, std::min(mean + sigmas_ * sigma, most));
  };
  const double alpha = absorption.alpha;
  const double beta = absorption.beta;
  const double low = alpha - sigmas_ * absorption.alpha_sigma;
  const double high = highest(alpha, absorption.alpha_sigma, most_.alpha);
  model_.evaluate({alpha, beta}, matrices_);
  estimated_ = matrices_.input;
  model_.evaluate({high, highest(beta, absorption.beta_sigma, most_.beta)}, matrices_);
  tightening_.input = matrices_.input;
  if (model_.parameters.size() == 2) {
    const double least = std::max(0.0, beta - sigmas_ * absorption.beta_sigma);
    model_.evaluate({high, least}, matrices_);
  }
  input_low_ = matrices_.input;
  // Heating by a pending power beyond the estimate.
  pending_excess_ = (tightening_.input - estimated_) * pending;
  pending_excess_low_ = (input_low_ - estimated_) * pending;
  std::array<double, kMaxMajorantTerms> applied = applied_;
  const double scale = largest_scale(low, high);
  const std::size_t terms = certificate_.decay.size();
  for (std::size_t j = 0; delayed && j < terms; ++j) {
    applied[j] = certificate_.decay[j] * applied[j] + pending;
  }
  for (int k = 0; k < stages_; ++k) {
    double left = 0.0;    // of the powers applied so far, at stage k + 1
    double caused = 0.0;  // by a power k + 1 periods before
    for (std::size_t j = 0; j < terms; ++j) {
      left += majorant_[(static_cast<std::size_t>(k) + 1) * terms + j] * applied[j];
      caused += majorant_[static_cast<std::size_t>(k) * terms + j];
    }
    const auto response = peak_powers_.row(k + 1);
    tightening_.free[k] =
        sigmas_ * sigma_[k] + scale * left +
        std::max({0.0, response.dot(pending_excess_), response.dot(pending_excess_low_)});
    const auto row = peak_powers_.row(k);
    const double more = std::max(0.0, row.dot(input_low_) - row.dot(tightening_.input));
    tightening_.impulse[k] = scale * caused * power_max_ + more * power_max_;
  }
  return tightening_;
}

}  // namespace photocoag
