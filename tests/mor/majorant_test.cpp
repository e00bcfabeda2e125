// A short sum of exponentials above a sequence.
#include "photocoag/mor/majorant.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace photocoag {
namespace {

TEST(Majorant, LiesAboveAndNotFarAbove) {
  const std::vector<double> decay = {0.999, 0.99, 0.9, 0.5, 0.0};
  std::vector<double> value;
  double sum = 0.0;
  for (int k = 1; k <= 3000; ++k) {
    value.push_back(std::pow(0.97, k) * (1.0 + 0.5 * std::sin(0.3 * k)) +
                    0.01 * std::pow(0.998, k));
    sum += value.back();
  }
  const double last = 1e-5;
  const std::vector<double> c = exponential_majorant(value, decay, last);
  ASSERT_EQ(c.size(), decay.size());
  double total = 0.0;
  for (int k = 1; k <= 3000; ++k) {
    EXPECT_GE(majorant_value(c, decay, k), value[static_cast<std::size_t>(k - 1)]);
    total += majorant_value(c, decay, k);
  }
  for (const double coefficient : c) EXPECT_GE(coefficient, 0.0);
  EXPECT_GE(c[0] * std::pow(0.999, 3000), last);
  EXPECT_LT(total, 4.0 * sum);
  // An exponential of the set is its own best majorant, up to the run of neighbours at its end.
  std::vector<double> own;
  for (int k = 1; k <= 60; ++k) own.push_back(3.0 * std::pow(0.9, k - 1));
  const std::vector<double> found = exponential_majorant(own, decay, 0.0);
  EXPECT_LT(majorant_value(found, decay, 1.0), 4.5);
}

}  // namespace
}  // namespace photocoag
