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
  constexpr std::string_view names[] = {"deim", "chebyshev", "taylor"};
  return names[static_cast<std::size_t>(kind)];
}

void Theta::evaluate(double alpha, TermVector& value, TermVector& slope) const noexcept {
  value.resize(terms);
  slope.resize(terms);
  if (kind == ThetaKind::kDeim) {
    for (int j = 0; j < terms; ++j) {
      const ValueAndSlope absorbed = points[j].evaluate(alpha);
      value[j] = absorbed.value;
      slope[j] = absorbed.slope[0];
    }
    return;
  }
  // Both polynomial families by their recurrence and its derivative; d/dalpha = d/dx / half_width.
  const double x = (alpha - factors[0].center) / factors[0].half_width;
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
  slope /= factors[0].half_width;
}

int Theta::terms_of(std::size_t parameter) const noexcept {
  if (parameter > 0) return factors[parameter].terms;
  int others = 1;
  for (std::size_t q = 1; q < kMaxParameters; ++q) others *= factors[q].terms;
  return terms / others;
}

void Theta::evaluate(AbsorptionFactors at, TermVector& value, TermSlopes& slope) const noexcept {
  value.resize(terms);
  for (TermVector& one : slope) one.resize(terms);
  if (kind != ThetaKind::kChebyshev) {
    for (int j = 0; j < terms; ++j) {
      const ValueAndSlope absorbed = points[j].evaluate(at);
      value[j] = absorbed.value;
      for (std::size_t q = 0; q < kMaxParameters; ++q) slope[q][j] = absorbed.slope[q];
    }
    return;
  }
  TermSlopes own;
  TermSlopes own_slope;
  for (std::size_t q = 0; q < kMaxParameters; ++q) {
    chebyshev((at[q] - factors[q].center) / factors[q].half_width, terms_of(q), own[q],
              own_slope[q]);
  }
  for (int j = 0; j < terms; ++j) {
    value[j] = 1.0;
    for (TermVector& one : slope) one[j] = 1.0;
    int rest = j;
    for (std::size_t q = 0; q < kMaxParameters; ++q) {
      const auto k = rest % own[q].size();
      rest /= static_cast<int>(own[q].size());
      value[j] *= own[q][k];
      for (std::size_t r = 0; r < kMaxParameters; ++r) {
        slope[r][j] *= r == q ? own_slope[q][k] : own[q][k];
        if (r == q) slope[r][j] /= factors[q].half_width;
      }
    }
  }
}

}  // namespace photocoag
