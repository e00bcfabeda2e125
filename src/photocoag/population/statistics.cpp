#include "photocoag/population/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "photocoag/core/percentile.hpp"

namespace photocoag {
namespace {

// Regularised incomplete beta function by its continued fraction (Lentz), Abramowitz and Stegun
// 26.5.8; the reflection keeps the fraction where it converges fast.
double incomplete_beta(double a, double b, double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  if (x > (a + 1.0) / (a + b + 2.0)) return 1.0 - incomplete_beta(b, a, 1.0 - x);
  constexpr double kTiny = 1e-300;
  double c = 1.0;
  double d = 1.0 / std::max(kTiny, std::abs(1.0 - (a + b) * x / (a + 1.0)));
  double fraction = d;
  for (int m = 1; m < 10'000; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    for (const double term : {even, odd}) {
      d = 1.0 + term * d;
      c = 1.0 + term / c;
      if (std::abs(d) < kTiny) d = kTiny;
      if (std::abs(c) < kTiny) c = kTiny;
      d = 1.0 / d;
      fraction *= c * d;
    }
    if (std::abs(c * d - 1.0) < 1e-15) break;
  }
  const double log_front =
      a * std::log(x) + b * std::log1p(-x) + std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b);
  return std::exp(log_front) * fraction / a;
}

// x with incomplete_beta(a, b, x) = probability.
double beta_quantile(double a, double b, double probability) {
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (incomplete_beta(a, b, middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&values](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t i = 0; i < order.size();) {
    std::size_t end = i;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    for (std::size_t k = i; k < end; ++k) {
      ranks[order[k]] = 0.5 * static_cast<double>(i + end - 1);
    }
    i = end;
  }
  return ranks;
}

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> kept;
  std::copy_if(values.begin(), values.end(), std::back_inserter(kept),
               [](double v) { return std::isfinite(v); });
  return kept;
}

}  // namespace

std::pair<double, double> binomial_interval(std::uint64_t hits, std::uint64_t trials,
                                            double confidence) {
  const double tail = 0.5 * (1.0 - confidence);
  const auto k = static_cast<double>(hits);
  const auto n = static_cast<double>(trials);
  return {hits == 0 ? 0.0 : beta_quantile(k, n - k + 1.0, tail),
          hits == trials ? 1.0 : beta_quantile(k + 1.0, n - k, 1.0 - tail)};
}

double rank_correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const std::vector<double> a = ranks_of(x);
  const std::vector<double> b = ranks_of(y);
  const double mean = 0.5 * (static_cast<double>(a.size()) - 1.0);
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean) * (b[i] - mean);
    aa += (a[i] - mean) * (a[i] - mean);
    bb += (b[i] - mean) * (b[i] - mean);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

double quantile(std::vector<double> values, double fraction) {
  values = finite(values);
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return percentile(std::move(values), fraction);
}

std::pair<double, double> mean_and_deviation(const std::vector<double>& values) {
  const std::vector<double> kept = finite(values);
  const auto count = static_cast<double>(kept.size());
  if (kept.empty()) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  const double mean = std::accumulate(kept.begin(), kept.end(), 0.0) / count;
  double squares = 0.0;
  for (const double v : kept) squares += (v - mean) * (v - mean);
  return {mean, count > 1.0 ? std::sqrt(squares / (count - 1.0)) : 0.0};
}

}  // namespace photocoag
