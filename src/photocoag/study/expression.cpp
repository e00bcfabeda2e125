#include "photocoag/study/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string_view>

#include "photocoag/core/error.hpp"
#include "photocoag/core/percentile.hpp"
#include "photocoag/core/random.hpp"

namespace photocoag {
namespace {

// Of campaigns and studies; core/random.hpp has those of treatments.
constexpr auto kResampling = static_cast<RandomStream>(997);

class Parser {
 public:
  /// `value` is called with every term and its place in the text.
  using Value = std::function<double(const Term&, std::size_t)>;
  Parser(const std::string& text, const Value& value) : text_(text), value_(value) {}

  PredicateResult predicate() {
    result_.holds = true;
    do {
      const bool holds = comparison();
      result_.holds = result_.holds && holds;
    } while (take("and"));
    if (!at_end()) fail("expected `and` or the end");
    return std::move(result_);
  }

 private:
  bool comparison() {
    const double left = sum();
    if (take("<=")) return left <= sum();
    if (take(">=")) return left >= sum();
    if (take("<")) return left < sum();
    if (take(">")) return left > sum();
    fail("expected <, <=, > or >=");
  }
  double sum() {
    double value = product();
    while (true) {
      if (take("+")) {
        value += product();
      } else if (take("-")) {
        value -= product();
      } else {
        return value;
      }
    }
  }
  double product() {
    double value = factor();
    while (true) {
      if (take("*")) {
        value *= factor();
      } else if (take("/")) {
        value /= factor();
      } else {
        return value;
      }
    }
  }
  double factor() {
    if (take("-")) return -factor();
    if (take("(")) {
      const double value = sum();
      need(")");
      return value;
    }
    skip_blanks();
    const char next = at_end() ? '\0' : text_[at_];
    return std::isdigit(static_cast<unsigned char>(next)) != 0 ? number() : call();
  }
  double number() {
    double value = 0.0;
    const auto [end, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc()) fail("not a number");
    at_ = static_cast<std::size_t>(end - text_.data());
    return value;
  }
  double call() {
    Term term;
    term.statistic = name();
    need("(");
    term.measure = name();
    need(",");
    term.run = name();
    if (take(",")) term.other = name();
    need(")");
    const double value = value_(term, result_.terms.size());
    result_.terms.push_back({std::move(term), value, value, value});
    return value;
  }
  std::string name() {
    skip_blanks();
    std::size_t end = at_;
    while (end < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[end])) != 0 || text_[end] == '_')) {
      ++end;
    }
    if (end == at_) fail("expected a name");
    std::string found = text_.substr(at_, end - at_);
    at_ = end;
    return found;
  }
  bool take(std::string_view token) {
    skip_blanks();
    if (text_.compare(at_, token.size(), token) != 0) return false;
    at_ += token.size();
    return true;
  }
  void need(std::string_view token) {
    if (!take(token)) fail(fmt::format("expected {}", token));
  }
  void skip_blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  bool at_end() {
    skip_blanks();
    return at_ == text_.size();
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw Error(ErrorParts{.problem = "not a predicate: " + problem,
                           .found = fmt::format("\"{}\", at character {}", text_, at_ + 1)});
  }

  const std::string& text_;
  const Value& value_;
  std::size_t at_ = 0;
  PredicateResult result_;
};

// Basic bootstrap: the draw's statistic reflected at the sample's.
double mirrored_at(double of_sample, double of_draw) {
  return std::isfinite(of_draw) && of_draw != of_sample ? 2.0 * of_sample - of_draw : of_draw;
}

}  // namespace

std::string Term::text() const {
  return fmt::format("{}({}, {}{}{})", statistic, measure, run, other.empty() ? "" : ", ", other);
}

PredicateResult evaluate_predicate(const std::string& text, const MeasureSource& source,
                                   int resamples) {
  std::vector<std::vector<double>> seeds;  // of every term
  PredicateResult result = Parser(text, [&](const Term& term, std::size_t) {
                             return statistic_of(term.statistic, seeds.emplace_back(source(term)));
                           }).predicate();
  result.support = result.holds ? 1.0 : 0.0;
  if (resamples <= 0) return result;
  std::vector<std::vector<double>> drawn(result.terms.size());
  int holds = 0;
  for (int r = 0; r < resamples; ++r) {
    std::vector<double> draws;  // one per seed, the same for all runs
    const auto mirrored = [&](const Term& term, std::size_t place) {
      const std::vector<double>& values = seeds[place];
      for (std::size_t i = draws.size(); i < values.size(); ++i) {
        draws.push_back(uniform(static_cast<std::uint64_t>(r), i, kResampling));
      }
      std::vector<double> picked(values.size());
      for (std::size_t i = 0; i < picked.size(); ++i) {
        picked[i] = values[static_cast<std::size_t>(draws[i] * static_cast<double>(values.size()))];
      }
      return mirrored_at(result.terms[place].value, statistic_of(term.statistic, picked));
    };
    const PredicateResult one = Parser(text, mirrored).predicate();
    holds += one.holds ? 1 : 0;
    for (std::size_t t = 0; t < drawn.size(); ++t) drawn[t].push_back(one.terms[t].value);
  }
  result.support = static_cast<double>(holds) / resamples;
  for (std::size_t t = 0; t < drawn.size(); ++t) {
    result.terms[t].low = percentile(drawn[t], 0.025);
    result.terms[t].high = percentile(drawn[t], 0.975);
  }
  return result;
}

double statistic_of(const std::string& statistic, std::vector<double> values) {
  const bool known = statistic == "min" || statistic == "max" || statistic == "mean" ||
                     statistic == "median" || statistic == "std";
  if (!known) {
    throw Error(ErrorParts{.problem = "unknown statistic",
                           .found = statistic,
                           .accepted = "min, max, mean, median, std"});
  }
  if (values.empty() ||
      std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  std::sort(values.begin(), values.end());
  const auto count = static_cast<double>(values.size());
  if (statistic == "min") return values.front();
  if (statistic == "max") return values.back();
  if (statistic == "median") {
    const std::size_t half = values.size() / 2;
    return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  }
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  if (statistic == "mean") return mean;
  double squares = 0.0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return values.size() < 2 ? 0.0 : std::sqrt(squares / (count - 1.0));
}

}  // namespace photocoag
