// Role: offline and simulated eye; the exponential as partial fractions, for zero-order hold where
// the heat operator is not separable. Used by fom. Test: tests/fom/layered_test.cpp
// (RationalExponential).
#pragma once

#include <array>
#include <complex>

namespace photocoag {

/// On the whole negative real axis
///   | e^x - r(x) | < 2.6e-12,   r(x) = at_infinity + sum_k 2 Re( residue_k / (x - pole_k) ),
/// with r(0) = 1 exactly, so that with the same poles
///   (e^x - 1) / x  is approximated by  (r(x) - 1) / x = sum_k 2 Re( (residue_k / pole_k) /
///   (x - pole_k) )
/// and a steady state stays one. Degree 12, one of each conjugate pair of poles.
///
/// How the numbers were found: x = 9 (t - 1) / (t + 1) maps t in (-1, 1] onto the negative axis;
/// the Chebyshev coefficients of t -> e^x make a Hankel matrix, and the roots outside the unit
/// circle of the polynomial of its 13th singular vector are the poles of the Caratheodory-Fejer
/// approximant (Trefethen, Weideman and Schmelzer, BIT 46 (2006) 653-670), which differs from the
/// best one by less than any double. Residues: linear least squares at 240 Chebyshev points of t
/// under the condition r(0) = 1, which costs a few per cent of the best error 2.4e-12
/// (9.289^-12). Computed with 34 digits.
struct RationalExponential {
  using Complex = std::complex<double>;
  static constexpr int kPairs = 6;
  static constexpr double kAtInfinity = 1.6513980081697234e-12;
  static constexpr std::array<Complex, kPairs> kPoles{{
      {4.8274934521644739, 1.1939879912234002},
      {4.2061242043218859, 3.5909207588856053},
      {2.9178685450832713, 6.017345924094162},
      {0.85170709672013188, 8.5038328256375154},
      {-2.2359682461249215, 11.109296232707493},
      {-6.9986879085957987, 13.995916624979394},
  }};
  static constexpr std::array<Complex, kPairs> kResidues{{
      {-11.79937975019734, -46.411635609401307},
      {18.785977180640881, 20.237285036220408},
      {-8.2382559464316985, -2.7961911221755782},
      {1.3194115869389675, -0.18352359118630232},
      {-0.068571498494683189, 0.038419070941465046},
      {0.00081843219710656241, -0.00058135305159115635},
  }};
};

}  // namespace photocoag
