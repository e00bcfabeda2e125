#include "photocoag/rom/theta.hpp"

namespace photocoag {

std::string_view to_string(ThetaKind kind) noexcept {
  switch (kind) {
    case ThetaKind::kDeim:
      return "deim";
    case ThetaKind::kChebyshev:
      return "chebyshev";
    case ThetaKind::kTaylor:
      return "taylor";
  }
  return "unknown";
}

void Theta::evaluate(double alpha, TermVector& value, TermVector& slope) const noexcept {
  value.resize(terms);
  slope.resize(terms);
  if (kind == ThetaKind::kDeim) {
    for (int j = 0; j < terms; ++j) {
      const ValueAndSlope absorbed = points[j].evaluate(alpha);
      value[j] = absorbed.value;
      slope[j] = absorbed.slope;
    }
    return;
  }
  // Both polynomial families by their recurrence and its derivative; d/dalpha = d/dx / half_width.
  const double x = (alpha - center) / half_width;
  for (int j = 0; j < terms; ++j) {
    if (j == 0) {
      value[j] = 1.0;
      slope[j] = 0.0;
    } else if (j == 1) {
      value[j] = x;
      slope[j] = 1.0;
    } else if (kind == ThetaKind::kTaylor) {
      value[j] = x * value[j - 1];
      slope[j] = value[j - 1] + x * slope[j - 1];
    } else {
      value[j] = 2.0 * x * value[j - 1] - value[j - 2];
      slope[j] = 2.0 * value[j - 1] + 2.0 * x * slope[j - 1] - slope[j - 2];
    }
  }
  slope /= half_width;
}

void Theta::evaluate(double alpha, double beta, TermVector& value, TermVector& slope,
                     TermVector& slope_choroid) const noexcept {
  value.resize(terms);
  slope.resize(terms);
  slope_choroid.resize(terms);
  for (int j = 0; j < terms; ++j) {
    const ValueAndSlope absorbed = points[j].evaluate(alpha, beta);
    value[j] = absorbed.value;
    slope[j] = absorbed.slope;
    slope_choroid[j] = absorbed.slope_choroid;
  }
}

}  // namespace photocoag
