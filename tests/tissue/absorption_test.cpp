// The Lambert-Beer law against its defining integral, done by quadrature in long double from the
// layers alone.
#include "photocoag/tissue/absorption.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// Four absorbing layers, two of them scaled, with a clear one between.
Tissue many_layers() {
  Tissue tissue;
  tissue.layers = {
      {"retina", 190e-6, 120.0},   {"RPE", 6e-6, 120400.0, ScaledBy::kAlpha},
      {"unpigmented", 4e-6, 0.0},  {"choriocapillaris", 20e-6, 9000.0, ScaledBy::kAlpha},
      {"choroid", 300e-6, 2662.2}, {"sclera", 100e-6, 50.0}};
  return tissue;
}

double coefficient(const Layer& layer, double alpha) {
  return layer.scaled_by == ScaledBy::kAlpha ? alpha * layer.absorption : layer.absorption;
}

// int_a^b mu(z) exp(-int_0^z mu) dz by Gauss-Legendre with five points on pieces that end at layer
// boundaries; the optical depth is carried along as a sum, so nothing of the code under test is
// used.
long double absorbed_by_quadrature(const Tissue& tissue, double alpha, double a, double b) {
  const long double node1 = std::sqrt(5.0L - 2.0L * std::sqrt(10.0L / 7.0L)) / 3.0L;
  const long double node2 = std::sqrt(5.0L + 2.0L * std::sqrt(10.0L / 7.0L)) / 3.0L;
  const long double weight1 = (322.0L + 13.0L * std::sqrt(70.0L)) / 900.0L;
  const long double weight2 = (322.0L - 13.0L * std::sqrt(70.0L)) / 900.0L;
  const long double nodes[5] = {-node2, -node1, 0.0L, node1, node2};
  const long double weights[5] = {weight2, weight1, 128.0L / 225.0L, weight1, weight2};
  long double front = 0.0L;
  long double optical_depth = 0.0L;
  long double sum = 0.0L;
  for (const Layer& layer : tissue.layers) {
    const long double mu = coefficient(layer, alpha);
    const long double back = front + layer.thickness;
    const long double low = std::max<long double>(a, front);
    const long double high = std::min<long double>(b, back);
    constexpr int kPieces = 40;
    for (int piece = 0; piece < kPieces && low < high; ++piece) {
      const long double half = (high - low) / (2 * kPieces);
      const long double middle = low + (2 * piece + 1) * half;
      for (int k = 0; k < 5; ++k) {
        const long double z = middle + half * nodes[k];
        sum += half * weights[k] * mu * std::exp(-(optical_depth + mu * (z - front)));
      }
    }
    optical_depth += mu * layer.thickness;
    front = back;
  }
  return sum;
}

TEST(Absorption, IsTheIntegralOfTheLambertBeerLaw) {
  for (const Tissue& tissue : {Tissue{}, many_layers()}) {
    const AbsorptionLaw law(tissue);
    const double depth = tissue.depth();
    for (const double alpha : {0.2, 0.7363, 1.1, 2.0}) {
      // Intervals inside a layer, across one boundary, across all, and up to the ends.
      for (const auto& [a, b] : std::vector<std::pair<double, double>>{{191e-6, 192e-6},
                                                                       {189e-6, 193e-6},
                                                                       {195e-6, 250e-6},
                                                                       {0.0, depth},
                                                                       {0.0, 191e-6},
                                                                       {300e-6, depth},
                                                                       {196e-6, 200e-6},
                                                                       {10e-6, 20e-6}}) {
        const double exact = static_cast<double>(absorbed_by_quadrature(tissue, alpha, a, b));
        // Depths are rounded sums: 3e-20 m times 240,800 1/m is 6e-15 of optical depth.
        EXPECT_NEAR(law.between(a, b).evaluate(alpha).value, exact, 1e-14) << a << ' ' << b;
      }
    }
  }
}

TEST(Absorption, SlopeIsTheDerivative) {
  const AbsorptionLaw law(many_layers());
  for (const double alpha : {0.2, 0.7363, 1.1, 2.0}) {
    for (const auto& [a, b] : std::vector<std::pair<double, double>>{
             {191e-6, 192e-6}, {189e-6, 240e-6}, {0.0, 0.0006}, {300e-6, 301e-6}}) {
      const AbsorbedFraction fraction = law.between(a, b);
      // Central difference with one Richardson step, in long double: error about 1e-13.
      const auto difference = [&](long double h) {
        const auto value = [&](long double at) {
          return std::exp(-(fraction.fixed_front + at * fraction.front[0])) -
                 std::exp(-(fraction.fixed_back + at * fraction.back[0]));
        };
        return (value(alpha + h) - value(alpha - h)) / (2.0L * h);
      };
      const long double slope = (4.0L * difference(5e-4L) - difference(1e-3L)) / 3.0L;
      EXPECT_NEAR(fraction.evaluate(alpha).slope[0], static_cast<double>(slope), 1e-12);
    }
  }
}

TEST(Absorption, CellsAddUpToTheWhole) {
  const Tissue tissue = many_layers();
  const AbsorptionLaw law(tissue);
  constexpr int kCells = 997;  // prime: faces miss the layer boundaries
  for (const double alpha : {0.2, 1.0, 2.0}) {
    double value = 0.0;
    double slope = 0.0;
    for (int i = 0; i < kCells; ++i) {
      const double front = tissue.depth() * i / kCells;
      const double back = tissue.depth() * (i + 1) / kCells;
      const ValueAndSlope cell = law.between(front, back).evaluate(alpha);
      EXPECT_GE(cell.value, 0.0);
      value += cell.value;
      slope += cell.slope[0];
    }
    const ValueAndSlope whole = law.whole().evaluate(alpha);
    // About 1000 roundings of numbers below 1, of random sign.
    EXPECT_NEAR(value, whole.value, 1e-14);
    EXPECT_NEAR(slope, whole.slope[0], 1e-14);
    // The whole in closed form: 1 - exp(-optical depth).
    double optical_depth = 0.0;
    for (const Layer& layer : tissue.layers) {
      optical_depth += coefficient(layer, alpha) * layer.thickness;
    }
    EXPECT_NEAR(whole.value, 1.0 - std::exp(-optical_depth), 1e-15);
  }
}

// In a cell of a nanometre or less exp(-a) - exp(-b) keeps few digits; the law must keep them.
TEST(Absorption, ThinCellsLoseNoDigits) {
  const AbsorbedFraction scaled{
      .fixed_front = 0.3, .fixed_back = 0.3, .front = {0.5}, .back = {0.5 + 0x1p-40}};
  const AbsorbedFraction fixed{
      .fixed_front = 0.5, .fixed_back = 0.5 + 0x1p-40, .front = {0.7}, .back = {0.7}};
  for (const double alpha : {0.3, 1.0, 1.9}) {
    const double thickness = 0x1p-40;
    const double front_scaled = std::exp(-(0.3 + alpha * 0.5));
    const double front_fixed = std::exp(-(0.5 + alpha * 0.7));
    // First order in the thickness; the second is 1e-12 of it, and 1 - 0.5 alpha cancels to 0.05.
    EXPECT_NEAR(scaled.evaluate(alpha).value / (front_scaled * alpha * thickness), 1.0, 2e-12);
    EXPECT_NEAR(scaled.evaluate(alpha).slope[0] / (front_scaled * thickness * (1.0 - 0.5 * alpha)),
                1.0, 1e-10);
    EXPECT_NEAR(fixed.evaluate(alpha).value / (front_fixed * thickness), 1.0, 2e-12);
    EXPECT_NEAR(fixed.evaluate(alpha).slope[0] / (-0.7 * front_fixed * thickness), 1.0, 2e-12);
  }
}

TEST(Absorption, ClearTissueAbsorbsNothing) {
  const AbsorptionLaw law{Tissue{}};
  EXPECT_EQ(law.between(0.0, 190e-6).evaluate(1.0).value, 0.0);
  EXPECT_EQ(law.between(0.0, 190e-6).evaluate(1.0).slope[0], 0.0);
  EXPECT_EQ(law.between(197e-6, 199e-6).evaluate(1.0).slope[0], 0.0);
  EXPECT_EQ(law.between(192e-6, 192e-6).evaluate(1.0).value, 0.0);
}

// More alpha: more light stays in the RPE, less reaches the choroid.
TEST(Absorption, TheRpeShadesTheChoroid) {
  const AbsorptionLaw law{Tissue{}};
  EXPECT_GT(law.between(190e-6, 196e-6).evaluate(1.0).slope[0], 0.0);
  EXPECT_LT(law.between(200e-6, 600e-6).evaluate(1.0).slope[0], 0.0);
  // 51 % at alpha = 1 (domain data).
  EXPECT_NEAR(law.between(190e-6, 196e-6).evaluate(1.0).value, 0.51, 0.005);
}

TEST(Absorption, RefusesATissueThatIsNotValid) {
  Tissue tissue;
  tissue.layers.clear();
  EXPECT_THROW(AbsorptionLaw{tissue}, Error);
}

}  // namespace
}  // namespace photocoag
