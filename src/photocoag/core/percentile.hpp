// Role: setup; the one percentile of samples. Used by run, population, study, apps, benchmarks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace photocoag {

/// The value below which `fraction` (0 to 1) of the values lie, by nearest rank. Precondition: not
/// empty.
template <typename T>
T percentile(std::vector<T> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace photocoag
