// Role: benchmarks; durations of one contender and what is reported of them: CPU time of the
// calling thread. By the wall a long solve is preempted on a busy machine and a short one is not,
// which favours the short one.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "photocoag/core/percentile.hpp"
#include "photocoag/core/thread_clock.hpp"

namespace photocoag::benchmarks {

using Json = nlohmann::ordered_json;

/// Durations in the order in which they were measured, us.
class Samples {
 public:
  template <typename Work>
  void time(const Work& work) {
    const double begin = thread_us();
    work();
    us_.push_back(thread_us() - begin);
  }

  void add(double us) { us_.push_back(us); }

  double first() const { return us_.front(); }
  double median() const { return percentile(us_, 0.5); }
  double p99() const { return percentile(us_, 0.99); }
  double max() const { return percentile(us_, 1.0); }
  std::size_t count() const { return us_.size(); }

  Json json(const std::string& name) const {
    return {{"name", name},    {"samples", count()}, {"median_us", median()},
            {"p99_us", p99()}, {"max_us", max()},    {"first_us", first()}};
  }

 private:
  std::vector<double> us_;
};

}  // namespace photocoag::benchmarks
