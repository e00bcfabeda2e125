// Measures of a closed loop, and of two that are compared.

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/core/outputs.hpp"
#include "photocoag/study/run_set.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kEarlyCycles = 3;  // stages that chi_3 leaves out
constexpr double kLateFrom = 50.0;       // ms, as rms_error_after_50_ms_K of summary.json

// End of the first cycle from which on the value stays within 5 % of the target; infinite: never.
double settled_from(const Trajectory& loop, const std::vector<double>& values, double target) {
  double settled = std::numeric_limits<double>::infinity();
  for (std::size_t k = values.size(); k-- > 0;) {
    if (std::abs(values[k] - target) > 0.05 * target) break;
    settled = loop.time_ms[k];
  }
  return settled;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
    largest = std::max(largest, std::abs(a[k] - b[k]));
  }
  return largest;
}

double rms_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0.0;
  const std::size_t count = std::min(a.size(), b.size());
  for (std::size_t k = 0; k < count; ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, count)));
}

double difference(const std::string& measure, const Trajectory& a, const Trajectory& b) {
  if (measure == "peak_difference_K") return largest_difference(a.peak_K, b.peak_K);
  if (measure == "peak_rms_difference_K") return rms_difference(a.peak_K, b.peak_K);
  if (measure == "estimate_rms_difference_K") {
    return rms_difference(a.peak_estimate_K, b.peak_estimate_K);
  }
  if (measure == "power_rms_difference_mW") return rms_difference(a.power_mW, b.power_mW);
  if (measure == "absorption_rms_difference") {
    return rms_difference(a.absorption_factor, b.absorption_factor);
  }
  throw Error(ErrorParts{.problem = "unknown measure of two runs",
                         .found = measure,
                         .accepted = "peak_difference_K, peak_rms_difference_K, "
                                     "estimate_rms_difference_K, "
                                     "power_rms_difference_mW, absorption_rms_difference"});
}

}  // namespace

std::map<std::string, double> measure(const Config& config, const Trajectory& loop) {
  const double reference = config.control.peak_reference;
  const double limit = config.control.peak_max;
  const double bound_mW = config.control.power_max * 1e3 * (1.0 - 1e-9);
  const double alpha = config.plant.absorption_factor;
  // The first cycle that the controller chose.
  const std::size_t begin = config.control.first_power > 0.0 ? 1 : 0;
  const std::size_t cycles = loop.peak_K.size();
  std::map<std::string, double> out;
  const auto peak_max = *std::max_element(loop.peak_K.begin(), loop.peak_K.end());
  out["peak_max_K"] = peak_max;
  out["overshoot_K"] = peak_max - reference;
  out["over_limit_K"] = peak_max - limit;
  // What an experiment can observe.
  const double estimate_max =
      *std::max_element(loop.peak_estimate_K.begin(), loop.peak_estimate_K.end());
  const double last_alpha = loop.absorption_factor.back();
  const auto lowest_from_the_start =
      *std::min_element(loop.absorption_factor.begin(), loop.absorption_factor.end());
  out["estimate_overshoot_K"] = estimate_max - reference;
  out["estimate_over_limit_K"] = estimate_max - limit;
  out["absorption_dip_percent"] = 100.0 * (1.0 - lowest_from_the_start / last_alpha);
  out["time_to_95_ms"] = std::numeric_limits<double>::infinity();
  out["settled_ms"] = settled_from(loop, loop.peak_K, reference);
  out["absorption_settled_ms"] = settled_from(loop, loop.absorption_factor, alpha);
  out["peak_end_K"] = loop.peak_K.back();
  double saturated = 0.0;
  double saturated_until = 0.0;
  double early = 0.0;
  double late_sum = 0.0;
  double late_squares = 0.0;
  double late = 0.0;
  double lowest_alpha = std::numeric_limits<double>::infinity();
  double highest_alpha = 0.0;
  double over = 0.0;
  bool still = true;
  for (std::size_t k = 0; k < cycles; ++k) {
    if (std::isinf(out["time_to_95_ms"]) && reached(loop.peak_K[k], reference)) {
      out["time_to_95_ms"] = loop.time_ms[k];
    }
    over += loop.peak_K[k] > limit ? 1.0 : 0.0;
    lowest_alpha = std::min(lowest_alpha, loop.absorption_factor[k]);
    highest_alpha = std::max(highest_alpha, loop.absorption_factor[k]);
    if (loop.time_ms[k] > kLateFrom) {
      const double error = loop.peak_K[k] - reference;
      late_sum += error;
      late_squares += error * error;
      late += 1.0;
    }
    if (k < begin) continue;
    const bool at_bound = loop.power_mW[k] >= bound_mW;
    saturated += at_bound ? 1.0 : 0.0;
    still = still && at_bound;
    if (still) saturated_until = loop.time_ms[k];
    if (k < begin + kEarlyCycles) early += loop.power_mW[k];
  }
  out["over_limit_cycles"] = over;
  out["saturated_cycles"] = saturated;
  out["saturated_until_ms"] = saturated_until;
  out["early_power_mW"] =
      early / static_cast<double>(std::min(kEarlyCycles, std::max<std::size_t>(1, cycles - begin)));
  out["first_power_mW"] = loop.power_mW[std::min(begin, cycles - 1)];
  out["power_max_mW"] = *std::max_element(
      loop.power_mW.begin() + static_cast<std::ptrdiff_t>(begin), loop.power_mW.end());
  out["first_reference_mW"] = loop.power_reference_mW.front();
  out["final_reference_mW"] = loop.power_reference_mW.back();
  out["late_mean_error_K"] = late > 0.0 ? late_sum / late : std::nan("");
  out["late_rms_error_K"] = late > 0.0 ? std::sqrt(late_squares / late) : std::nan("");
  out["absorption_undershoot_percent"] = 100.0 * (1.0 - lowest_alpha / alpha);
  out["absorption_overshoot_percent"] = 100.0 * (highest_alpha / alpha - 1.0);
  out["absorption_final_error_percent"] =
      100.0 * std::abs(loop.absorption_factor.back() / alpha - 1.0);
  return out;
}

const RunResult& run_of(const std::vector<RunResult>& results, std::string_view id) {
  for (const RunResult& result : results) {
    if (result.id == id) return result;
  }
  throw Error(ErrorParts{.problem = "no such run in the study", .found = std::string(id)});
}

MeasureSource measures_of(const std::vector<RunResult>& results) {
  return [&results](const Term& term) {
    const RunResult& run = run_of(results, term.run);
    if (!term.other.empty()) {
      const RunResult& other = run_of(results, term.other);
      std::vector<double> values;
      for (std::size_t s = 0; s < run.trajectories.size(); ++s) {
        values.push_back(difference(term.measure, run.trajectories[s], other.trajectories.at(s)));
      }
      return values;
    }
    const auto found = run.measures.find(term.measure);
    if (found != run.measures.end()) return found->second;
    std::string known;
    for (const auto& [name, values] : run.measures) known += (known.empty() ? "" : ", ") + name;
    throw Error(ErrorParts{.problem = "unknown measure", .found = term.measure, .accepted = known});
  };
}

}  // namespace photocoag
