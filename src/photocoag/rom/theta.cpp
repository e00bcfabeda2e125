#include "photocoag/rom/theta.hpp"

namespace photocoag {
namespace {

// T_0 … T_(terms-1) at x and their derivatives by x.
void chebyshev(double x, int terms, TermVector& value, TermVector& slope) noexcept {
  value.setOnes(terms);
  slope.setZero(terms);
  if (terms > 1) {
    value[1] = x;
    slope[1] = 1.0;
  }
  for (int j = 2; j < terms; ++j) {
    value[j] = 2.0 * x * value[j - 1] - value[j - 2];
    slope[j] = 2.0 * value[j - 1] + 2.0 * x * slope[j - 1] - slope[j - 2];
  }
}

}  // namespace

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
  if (kind == ThetaKind::kChebyshev) {
    const int own = terms / choroid_terms;
    TermVector a;
    TermVector a_slope;
    TermVector b;
    TermVector b_slope;
    chebyshev((alpha - center) / half_width, own, a, a_slope);
    chebyshev((beta - choroid_center) / choroid_half_width, choroid_terms, b, b_slope);
    for (int k = 0; k < choroid_terms; ++k) {
      for (int j = 0; j < own; ++j) {
        value[k * own + j] = a[j] * b[k];
        slope[k * own + j] = a_slope[j] / half_width * b[k];
        slope_choroid[k * own + j] = a[j] * b_slope[k] / choroid_half_width;
      }
    }
    return;
  }
  for (int j = 0; j < terms; ++j) {
    const ValueAndSlope absorbed = points[j].evaluate(alpha, beta);
    value[j] = absorbed.value;
    slope[j] = absorbed.slope;
    slope_choroid[j] = absorbed.slope_choroid;
  }
}

}  // namespace photocoag
