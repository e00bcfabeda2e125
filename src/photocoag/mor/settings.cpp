#include "photocoag/mor/settings.hpp"

#include <fmt/format.h>

#include "photocoag/core/check.hpp"

namespace photocoag {

ParameterDependence ReductionSettings::dependence() const noexcept {
  return method == ReductionMethod::kTaylor ? ParameterDependence::kTaylor : parameter_dependence;
}

int ReductionSettings::terms(bool two_parameters) const noexcept {
  const int chebyshev = two_parameters ? 12 : 8;
  const int others = two_parameters ? 8 : 5;
  if (parameter_terms > 0) return parameter_terms;
  return dependence() == ParameterDependence::kChebyshev ? chebyshev : others;
}

bool ReductionSettings::refined() const noexcept {
  return refinement == Refinement::kOutputError && method != ReductionMethod::kBalancedTwoSided;
}

std::string ReductionSettings::name() const {
  return std::string(to_string(method)) + (refined() ? ", refined" : "");
}

void ReductionSettings::validate() const {
  require(order >= 1 && order <= 14, "model.order", order, "an integer from 1 to 14");
  require(parameter_terms >= 0 && parameter_terms <= 12, "model.parameter_terms", parameter_terms,
          "an integer from 0 to 12");
  require_between(choroid_min, 0.05, 20.0, "model.choroid_min");
  require_between(choroid_max, 0.05, 20.0, "model.choroid_max");
  require(choroid_min < choroid_max, "model.choroid_max", choroid_max,
          fmt::format("above model.choroid_min = {}", choroid_min));
}

}  // namespace photocoag
