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

enum class ThetaKind {
  kDeim,       ///< theta_j = absorbed fraction of the grid cell that DEIM chose
  kChebyshev,  ///< theta_j = T_j(x), x = (alpha - center) / half_width; for two parameters the
               ///< products T_j(x) T_k(y), y the same for beta, with j running fastest
  kTaylor,     ///< theta_j = (alpha - center)^j
};

/// The word in the model file.
std::string_view to_string(ThetaKind kind) noexcept;

struct Theta {
  std::array<AbsorbedFraction, kMaxTerms> points{};  ///< kDeim: one per term
  int terms = 0;
  ThetaKind kind = ThetaKind::kDeim;
  double center = 0.0;          ///< kChebyshev, kTaylor
  double half_width = 1.0;      ///< kChebyshev; 1 for kTaylor
  int choroid_terms = 1;        ///< kChebyshev: factors T_k(y); 1: beta plays no part
  double choroid_center = 1.0;  ///< kChebyshev with beta
  double choroid_half_width = 1.0;

  /// theta_j(alpha) and their exact derivatives, j = 0 … terms - 1; beta plays no part or
  /// (kDeim) is 1.
  void evaluate(double alpha, TermVector& value, TermVector& slope) const noexcept;

  /// The same at a choroid factor beta, with the derivatives by it. Not kTaylor.
  void evaluate(double alpha, double beta, TermVector& value, TermVector& slope,
                TermVector& slope_choroid) const noexcept;

  bool operator==(const Theta&) const = default;
};

}  // namespace photocoag
