#include "photocoag/rom/certificate.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

double interpolate(const std::vector<double>& x, const std::vector<double>& y, double at) noexcept {
  const double inside = std::clamp(at, x.front(), x.back());
  const auto upper = std::upper_bound(x.begin() + 1, x.end() - 1, inside);
  const auto i = static_cast<std::size_t>(upper - x.begin());
  const double fraction = (inside - x[i - 1]) / (x[i] - x[i - 1]);
  return y[i - 1] + fraction * (y[i] - y[i - 1]);
}

void trust(bool ok, std::string_view key, std::string_view accepted) {
  if (ok) return;
  throw Error(ErrorParts{.key = fmt::format("certificate.{}", key),
                         .problem = "the certificate cannot be trusted",
                         .accepted = std::string(accepted)});
}

bool not_negative(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value) && value >= 0.0; });
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

}  // namespace

double OutputCertificate::relative_max() const noexcept { return largest(relative); }

double OutputCertificate::treatment_relative_max() const noexcept {
  return largest(treatment_relative);
}

Outputs ErrorCertificate::bound(double alpha, double power_max) const noexcept {
  return {.volume = power_max * interpolate(absorption_factors, volume.bound, alpha),
          .peak = power_max * interpolate(absorption_factors, peak.bound, alpha)};
}

void ErrorCertificate::validate() const {
  const std::size_t nodes = absorption_factors.size();
  const auto descending = std::adjacent_find(absorption_factors.begin(), absorption_factors.end(),
                                             std::greater_equal<>());
  trust(nodes >= 2 && not_negative(absorption_factors) && descending == absorption_factors.end(),
        "absorption_factors", "at least two, ascending");
  trust(!decay.empty() && decay.size() <= kMaxMajorantTerms && not_negative(decay) &&
            *std::max_element(decay.begin(), decay.end()) < 1.0,
        "decay", fmt::format("1 to {} numbers from 0 to below 1", kMaxMajorantTerms));
  trust(std::isfinite(treatment_duration) && treatment_duration >= 0.0, "treatment_duration_s",
        "not negative");
  trust(std::isfinite(tail_relative) && tail_relative >= 0.0, "tail_relative", "not negative");
  for (const auto& [name, output] : {std::pair("peak", &peak), std::pair("volume", &volume)}) {
    trust(output->bound.size() == nodes && output->relative.size() == nodes &&
              output->treatment_bound.size() == nodes &&
              output->treatment_relative.size() == nodes && output->sum.size() == nodes &&
              output->scale.size() == nodes && output->majorant.size() == decay.size(),
          name, "one number of each kind per node, one majorant per decay");
    trust(not_negative(output->bound) && not_negative(output->relative) &&
              not_negative(output->treatment_bound) && not_negative(output->treatment_relative) &&
              not_negative(output->sum) && not_negative(output->scale) &&
              not_negative(output->majorant),
          name, "finite numbers, not negative");
    // No model of a few states is exact; the bound for both signs is at least that for one sign,
    // and that of a treatment at most.
    for (std::size_t i = 0; i < nodes; ++i) {
      constexpr double kRounding = 1.0 + 1e-9;
      trust(output->bound[i] > 0.0 && output->scale[i] > 0.0 && output->relative[i] > 0.0 &&
                output->bound[i] <= kRounding * output->sum[i] &&
                output->treatment_bound[i] <= kRounding * output->bound[i],
            name,
            "bounds above 0: of a treatment, of any length, of powers of both signs, in this "
            "order");
    }
    trust(*std::max_element(output->majorant.begin(), output->majorant.end()) > 0.0, name,
          "a majorant above 0");
  }
}

RunningErrorBound::RunningErrorBound(const ErrorCertificate& certificate)
    : certificate_(certificate) {
  certificate_.validate();
}

void RunningErrorBound::reset() noexcept { state_.fill(0.0); }

void RunningErrorBound::step(double power) noexcept {
  for (std::size_t j = 0; j < certificate_.decay.size(); ++j) {
    state_[j] = certificate_.decay[j] * state_[j] + power;
  }
}

Outputs RunningErrorBound::bound(double alpha) const noexcept {
  Outputs sum;
  for (std::size_t j = 0; j < certificate_.decay.size(); ++j) {
    sum.peak += certificate_.peak.majorant[j] * state_[j];
    sum.volume += certificate_.volume.majorant[j] * state_[j];
  }
  const std::vector<double>& nodes = certificate_.absorption_factors;
  return {.volume = sum.volume * interpolate(nodes, certificate_.volume.scale, alpha),
          .peak = sum.peak * interpolate(nodes, certificate_.peak.scale, alpha)};
}

}  // namespace photocoag
