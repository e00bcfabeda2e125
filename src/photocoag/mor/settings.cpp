#include "photocoag/mor/settings.hpp"

#include "photocoag/core/check.hpp"

namespace photocoag {

ParameterDependence ReductionSettings::dependence() const noexcept {
  return method == ReductionMethod::kTaylor ? ParameterDependence::kTaylor : parameter_dependence;
}

int ReductionSettings::terms() const noexcept {
  constexpr int kChebyshevTerms = 8;
  constexpr int kTerms = 5;
  if (parameter_terms > 0) return parameter_terms;
  return dependence() == ParameterDependence::kChebyshev ? kChebyshevTerms : kTerms;
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
}

}  // namespace photocoag
