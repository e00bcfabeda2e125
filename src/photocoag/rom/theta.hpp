// Role: online and offline; the coefficient functions theta_j(alpha) of B and C_vol. Used by rom,
// mor. Source: DEIM: Chaturantabut and Sorensen (2010); Chebyshev: Trefethen, "Approximation Theory
// and Approximation Practice" (2013), ch. 3; docs/models.md. Units: 1.
// Real time: evaluate() is noexcept and does not allocate. Threads: plain data.
#pragma once

#include <array>
#include <string_view>

#include "photocoag/core/types.hpp"
#include "photocoag/tissue/absorption.hpp"

namespace photocoag {

inline constexpr int kMaxTerms = 12;  // terms of B(alpha) and C_vol(alpha)

using TermVector = BoundedVector<kMaxTerms>;
using TermSlopes = std::array<TermVector, kMaxParameters>;

enum class ThetaKind {
  kDeim,       ///< theta_j = absorbed fraction of the grid cell that DEIM chose
  kChebyshev,  ///< theta_j = T_j(x), x = (alpha - center) / half_width; for several parameters the
               ///< products of their polynomials, alpha's index running fastest
  kTaylor,     ///< theta_j = (alpha - center)^j
};

/// The word in the model file.
std::string_view to_string(ThetaKind kind) noexcept;

/// The polynomials in one parameter p, of x = (p - center) / half_width.
struct ThetaFactor {
  int terms = 1;  ///< 1: no dependence on it; alpha's are derived (Theta::terms_of)
  double center = 0.0;
  double half_width = 1.0;

  bool operator==(const ThetaFactor&) const = default;
};

struct Theta {
  std::array<AbsorbedFraction, kMaxTerms> points{};  ///< kDeim: one per term
  int terms = 0;
  ThetaKind kind = ThetaKind::kDeim;
  std::array<ThetaFactor, kMaxParameters> factors{};  ///< kChebyshev; kTaylor: the first

  /// Number of terms of one parameter's factor; alpha's is `terms` divided by the others'.
  int terms_of(std::size_t parameter) const noexcept;

  /// theta_j(alpha) and their exact derivatives, j = 0 … terms - 1; the other parameters do not
  /// enter or (kDeim) are 1.
  void evaluate(double alpha, TermVector& value, TermVector& slope) const noexcept;

  /// The same at all parameters, with the derivatives by each. Not kTaylor.
  void evaluate(AbsorptionFactors at, TermVector& value, TermSlopes& slope) const noexcept;

  bool operator==(const Theta&) const = default;
};

}  // namespace photocoag
