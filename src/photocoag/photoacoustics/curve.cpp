#include "photocoag/photoacoustics/curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {

CurveData water_like_curve() {
  return {.source = "water-like, common in photoacoustics; not verified for the ocular fundus",
          .coefficients = {0.0053, 0.0043},
          .temperatures = {},
          .values = {},
          .valid_from_celsius = 1.0,
          .valid_to_celsius = 100.0};
}

GrueneisenCurve::GrueneisenCurve(const CurveData& data, const std::string& where)
    : low_(data.valid_from_celsius), high_(data.valid_to_celsius) {
  const auto check = [&where](bool good, std::string_view key, std::string found,
                              std::string_view accepted) {
    if (good) return;
    throw Error(ErrorParts{.where = where,
                           .key = "curve." + std::string(key),
                           .found = std::move(found),
                           .accepted = std::string(accepted)});
  };
  const bool polynomial = !data.coefficients.empty();
  const std::size_t points = data.temperatures.size();
  check(polynomial != (points > 0), "coefficients", polynomial ? "and a table too" : "nothing",
        "either coefficients, or temperatures_C with values");
  check(std::isfinite(low_) && std::isfinite(high_) && low_ < high_ && low_ >= -50.0 &&
            high_ <= 300.0,
        "valid_C", fmt::format("{} to {}", low_, high_), "an interval between -50 and 300 deg C");
  for (const double c : data.coefficients) {
    check(std::isfinite(c), "coefficients", fmt::format("{}", c), "finite numbers");
  }
  if (polynomial) {
    check(data.coefficients.size() >= 2 && data.coefficients.size() <= kMostCoefficients,
          "coefficients", fmt::format("{} numbers", data.coefficients.size()), "2 to 6 numbers");
    degree_ = data.coefficients.size() - 1;
    std::copy(data.coefficients.begin(), data.coefficients.end(), coefficients_.begin());
  } else {
    check(points >= 2 && points <= kMostPoints && data.values.size() == points, "values",
          fmt::format("{} temperatures, {} values", points, data.values.size()),
          "2 to 64 temperatures and as many values");
    for (std::size_t i = 0; i < points; ++i) {
      const bool first = i == 0;
      check(std::isfinite(data.temperatures[i]) && std::isfinite(data.values[i]), "values",
            "not finite", "finite numbers");
      check(first || data.temperatures[i] > data.temperatures[i - 1], "temperatures_C",
            fmt::format("{}", data.temperatures[i]), "ascending temperatures");
    }
    std::copy(data.temperatures.begin(), data.temperatures.end(), temperatures_.begin());
    std::copy(data.values.begin(), data.values.end(), values_.begin());
    points_ = points;
    check(low_ >= temperatures_[0] && high_ <= temperatures_[points - 1], "valid_C",
          fmt::format("{} to {}", low_, high_), "inside the table");
  }
  constexpr int kSamples = 1000;
  double before = 0.0;  // the first value must be above 0
  for (int i = 0; i <= kSamples; ++i) {
    const double celsius = low_ + (high_ - low_) * i / kSamples;
    const double now = value(celsius);
    check(now > before, polynomial ? "coefficients" : "values",
          fmt::format("{:g} at {:g} deg C", now, celsius),
          "a curve above 0 that rises everywhere between the ends of valid_C");
    before = now;
  }
}

std::size_t GrueneisenCurve::segment(double celsius) const noexcept {
  std::size_t i = 1;
  while (i + 1 < points_ && celsius > temperatures_[i]) ++i;
  return i;
}

double GrueneisenCurve::value(double celsius) const noexcept {
  if (points_ > 0) {
    const std::size_t i = segment(celsius);
    return values_[i - 1] + slope(celsius) * (celsius - temperatures_[i - 1]);
  }
  double sum = 0.0;
  for (std::size_t k = degree_ + 1; k-- > 0;) sum = sum * celsius + coefficients_[k];
  return sum;
}

double GrueneisenCurve::slope(double celsius) const noexcept {
  if (points_ > 0) {
    const std::size_t i = segment(celsius);
    return (values_[i] - values_[i - 1]) / (temperatures_[i] - temperatures_[i - 1]);
  }
  double sum = 0.0;
  for (std::size_t k = degree_; k > 0; --k) {
    sum = sum * celsius + static_cast<double>(k) * coefficients_[k];
  }
  return sum;
}

double GrueneisenCurve::temperature(double wanted) const noexcept {
  // Also false for NaN.
  if (!(wanted >= value(low_) && wanted <= value(high_))) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (linear()) return (wanted - coefficients_[0]) / coefficients_[1];
  double low = low_;
  double high = high_;
  for (int i = 0; i < 50; ++i) {  // 350 K / 2^50
    const double middle = 0.5 * (low + high);
    (value(middle) < wanted ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace photocoag
