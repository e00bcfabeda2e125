#include "photocoag/core/step_response.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "photocoag/core/error.hpp"

namespace photocoag {

std::vector<std::size_t> ascending_times(const std::vector<double>& times) {
  for (const double time : times) {
    if (std::isfinite(time) && time >= 0.0 && time <= 1e4) continue;
    throw Error(ErrorParts{.key = "--times",
                           .found = fmt::format("{}", time),
                           .accepted = "times in seconds from 0 to 10000"});
  }
  std::vector<std::size_t> order(times.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&times](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  return order;
}

std::size_t whole_periods(double time, double period) {
  const double periods = std::round(time / period);
  if (std::abs(time - periods * period) > 1e-9 * std::max(time, period)) {
    throw Error(ErrorParts{
        .key = "--times",
        .problem = "this discretization advances in whole control periods",
        .found = fmt::format("{} s", time),
        .accepted = fmt::format("multiples of control.period_ms = {} ms, or the discretization "
                                "\"zero-order-hold\" for any time",
                                period * 1e3)});
  }
  return static_cast<std::size_t>(periods);
}

}  // namespace photocoag
