// Role: benchmarks; durations of one contender and what is reported of them.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace photocoag::benchmarks {

using Json = nlohmann::ordered_json;

/// Durations in the order in which they were measured, us.
class Samples {
 public:
  template <typename Work>
  void time(const Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::micro> elapsed =
        std::chrono::steady_clock::now() - begin;
    us_.push_back(elapsed.count());
  }

  double first() const { return us_.front(); }
  double median() const { return quantile(0.5); }
  double p99() const { return quantile(0.99); }
  double max() const { return quantile(1.0); }
  std::size_t count() const { return us_.size(); }

  Json json(const std::string& name) const {
    return {{"name", name},    {"samples", count()}, {"median_us", median()},
            {"p99_us", p99()}, {"max_us", max()},    {"first_us", first()}};
  }

 private:
  double quantile(double fraction) const {
    std::vector<double> sorted = us_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size() - 1) +
                                           0.5)];
  }

  std::vector<double> us_;
};

}  // namespace photocoag::benchmarks
