// Predicates: grammar, values, and what is refused.
#include "photocoag/study/expression.hpp"

#include <gtest/gtest.h>

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

TEST(Expression, RefusesWhatItDoesNotUnderstand) {
  for (const char* text : {"", "1", "1 <", "max(x a) < 1", "max(x, a) < 1 or 1 < 2",
                           "best(x, a) < 1", "max(x, b) < 1", "1 < 2 < 3", "(1 < 2"}) {
    EXPECT_THROW(evaluate_predicate(text, source), Error) << text;
  }
}

}  // namespace
}  // namespace photocoag
