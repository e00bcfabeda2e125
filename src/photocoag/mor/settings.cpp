#include "photocoag/mor/settings.hpp"

#include <fmt/format.h>

#include "photocoag/core/check.hpp"
#include "photocoag/core/setting.hpp"

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

std::vector<Field> fields_of(ReductionSettings& s) {
  using namespace units;
  FieldTable table("model");
  table.integer("order", s.order, 1, 14, "states of the reduced model");
  table.word("method", s.method, {kReductionMethodWords.begin(), kReductionMethodWords.end()},
             "what spans the reduced states; the paper's: POD over alpha");
  table.word("refinement", s.refinement, {kRefinementWords.begin(), kRefinementWords.end()},
             "fits the projected model's numbers to the full-order model's responses");
  table.word("parameter_dependence", s.parameter_dependence,
             {kParameterDependenceWords.begin(), kParameterDependenceWords.end()},
             "how inputs and volume output depend on alpha; method \"taylor\" uses its own series");
  table.integer("parameter_terms", s.parameter_terms, 0, 12,
                "its number of terms; 0: 8 for \"chebyshev\", else 5; with beta 12 and 8");
  table.number("choroid_min", s.choroid_min, kOne, {0.05, 20},
               "smallest beta for which the model is made and its error measured");
  table.number("choroid_max", s.choroid_max, kOne, {0.05, 20},
               "largest; used only if a layer has scaled_by = \"beta\"");
  return table.take();
}

void ReductionSettings::validate() const {
  ReductionSettings own = *this;
  require_in_range(fields_of(own));
  require(choroid_min < choroid_max, "model.choroid_max", choroid_max,
          fmt::format("above model.choroid_min = {}", choroid_min));
}

}  // namespace photocoag
