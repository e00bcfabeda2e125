#include "photocoag/estimation/extended_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "photocoag/core/check.hpp"

namespace photocoag {
namespace {

// As allFinite(), in a third of its time.
template <typename Matrix>
bool all_finite(const Matrix& matrix) noexcept {
  const double* data = matrix.data();
  const int size = static_cast<int>(matrix.size());
  double even = 0.0;  // stays 0: 0 times what is not finite is NaN
  double odd = 0.0;
  int i = 0;
  for (; i + 1 < size; i += 2) {
    even += 0.0 * data[i];
    odd += 0.0 * data[i + 1];
  }
  if (i < size) even += 0.0 * data[i];
  return even == 0.0 && odd == 0.0;
}

}  // namespace

ExtendedEstimate::ExtendedEstimate(const ReducedModel& model, const EstimatorSettings& settings)
    : model_(model),
      decay_(diagonal_alone(model.A_d)),
      settings_(settings),
      order_(model.order()),
      unknowns_(settings.unknown_count()),
      gate_(settings.outlier_sigma) {
  settings.validate();
  require(static_cast<int>(model.parameters.size()) >= settings.unknown_count(),
          "estimator.unknowns", std::string_view("\"rpe-and-choroid\""),
          "\"rpe\", or a model with both parameters: a [tissue] with a layer that has scaled_by = "
          "\"beta\"");
}

void ExtendedEstimate::reset_estimate() noexcept {
  state_.setZero(order_);
  covariance_.setZero(order_ + unknowns_, order_ + unknowns_);
  const Parameters sigma{settings_.absorption_sigma_initial, settings_.choroid_sigma_initial};
  for (int q = 0; q < unknowns_; ++q) {
    covariance_(order_ + q, order_ + q) = sigma[q] * sigma[q];
  }
  innovation_ = 0.0;
  innovation_sigma_ = 0.0;
  gate_.reset();
  parameters_ = {settings_.absorption_initial, settings_.choroid_initial};
  evaluate_at(model_, parameters_, matrices_);
}

bool ExtendedEstimate::finite_estimate() const noexcept {
  if (!std::isfinite(parameters_[0]) || !std::isfinite(parameters_[1])) return false;
  if (!all_finite(state_) || !all_finite(covariance_)) return false;
  const Outputs estimate = outputs();
  return std::isfinite(estimate.volume) && std::isfinite(estimate.peak);
}

double ExtendedEstimate::absorption_sigma() const noexcept {
  return std::sqrt(std::max(0.0, covariance_(order_, order_)));
}

double ExtendedEstimate::choroid_sigma() const noexcept {
  return unknowns_ == 1 ? 0.0 : std::sqrt(std::max(0.0, covariance_(order_ + 1, order_ + 1)));
}

Outputs ExtendedEstimate::outputs() const noexcept {
  return {.volume = matrices_.volume.dot(state_), .peak = model_.C_peak.dot(state_)};
}

double ExtendedEstimate::peak_sigma() const noexcept {
  return extended_peak_sigma(model_.C_peak, covariance_);
}

}  // namespace photocoag
