// Predicates: grammar, values, and what is refused.
#include "photocoag/study/expression.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

std::vector<double> source(const Term& term) {
  if (term.run == "a") return {1.0, 2.0, 6.0};
  if (term.run == "never") return {1.0, std::numeric_limits<double>::infinity()};
  if (term.run == "none") return {1.0, std::nan("")};
  throw Error("no run " + term.run);
}

bool holds(const std::string& text) { return evaluate_predicate(text, source).holds; }

TEST(Expression, ComputesAsWritten) {
  EXPECT_TRUE(
      holds("min(x, a) >= 1 and max(x, a) <= 6 and median(x, a) < 2.5 and mean(x, a) > 2.9"));
  EXPECT_TRUE(holds("1 + 2 * 3 < 7.5"));
  EXPECT_FALSE(holds("(1 + 2) * 3 < 7.5"));
  EXPECT_TRUE(holds("8 / 4 / 2 <= 1"));
  EXPECT_TRUE(holds("-max(x, a) < 0 - 5"));
  EXPECT_FALSE(holds("1 < 2 and 2 < 1"));
  EXPECT_FALSE(holds("2 < 1 and 1 < 2"));
}

TEST(Expression, EveryCallIsReported) {
  const PredicateResult result = evaluate_predicate("1 < 0 and max(x, a) < min(x, a)", source);
  ASSERT_EQ(result.terms.size(), 2U);  // what is false already does not hide the numbers
  EXPECT_EQ(result.terms[0].term.text(), "max(x, a)");
  EXPECT_EQ(result.terms[0].value, 6.0);
}

TEST(Expression, NeverIsLaterThanAnythingAndNoValueProvesNothing) {
  EXPECT_FALSE(holds("max(x, never) <= 1e300"));
  EXPECT_FALSE(holds("max(x, none) <= 1e300"));
  EXPECT_FALSE(holds("max(x, none) >= 0"));
}

// Draws of the seeds with replacement: what a statistic owes to the seeds that were taken.
TEST(Expression, ResamplingTellsChanceFromEffect) {
  const auto values = [](const Term& term) {
    std::vector<double> all(20, term.run == "apart" ? 1.0 : 0.0);
    if (term.run == "one_of_twenty") all.back() = 5.0;
    if (term.run == "half") std::fill(all.begin(), all.begin() + 10, 1.0);
    return all;
  };
  const auto support = [&](const std::string& text) {
    return evaluate_predicate(text, values, 1000).support;
  };
  EXPECT_EQ(support("mean(x, apart) > 0.5"), 1.0);
  EXPECT_EQ(support("mean(x, apart) < 0.5"), 0.0);
  // More seeds only raise a maximum: above the threshold it stays there, below it need not. Of the
  // draws (1 - 1/20)^20 = 0.358 miss one seed of twenty; 0.05 is three deviations of 1000.
  EXPECT_EQ(support("max(x, one_of_twenty) > 4.9"), 1.0);
  EXPECT_NEAR(support("max(x, one_of_twenty) < 5.1"), 1.0 - 0.358, 0.05);
  // The mean of twenty draws of a fair coin: 0.5 with a deviation of 0.112.
  const PredicateResult half = evaluate_predicate("mean(x, half) > 0.5", values, 1000);
  EXPECT_NEAR(half.terms.front().low, 0.5 - 1.96 * 0.112, 0.06);
  EXPECT_NEAR(half.terms.front().high, 0.5 + 1.96 * 0.112, 0.06);
  // The same draw for all runs: what is the same in every seed stays the same.
  EXPECT_EQ(support("mean(x, half) - mean(y, half) < 1e-12"), 1.0);
  EXPECT_EQ(evaluate_predicate("mean(x, half) > 0.4", values).support, 1.0);
}

TEST(Expression, RefusesWhatItDoesNotUnderstand) {
  for (const char* text : {"", "1", "1 <", "max(x a) < 1", "max(x, a) < 1 or 1 < 2",
                           "best(x, a) < 1", "max(x, b) < 1", "1 < 2 < 3", "(1 < 2"}) {
    EXPECT_THROW(evaluate_predicate(text, source), Error) << text;
  }
}

}  // namespace
}  // namespace photocoag
