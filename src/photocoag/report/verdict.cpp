#include "photocoag/report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "photocoag/core/outputs.hpp"

namespace photocoag {
namespace {

std::string plural(std::int64_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string milliseconds(double seconds) { return fmt::format("{:.4g} ms", 1e3 * seconds); }

// The highest peak that is known, and what to call it.
struct Peak {
  std::string_view name = "peak";
  double value = NAN;
};

Peak known_peak(const RunSummary& summary) {
  if (summary.peak_true_max_K) return {"peak", *summary.peak_true_max_K};
  if (summary.peak_estimate_max_K) return {"estimated peak", *summary.peak_estimate_max_K};
  return {};
}

// "peak 30.6 K, limit 32 K not exceeded, 95 % after 7 ms"
std::string facts(const RunSummary& summary) {
  const Peak peak = known_peak(summary);
  if (!std::isfinite(peak.value)) return "no peak temperature known";
  std::string text = fmt::format("{} {} K, limit {:g} K {}exceeded", peak.name,
                                 decisive(peak.value, summary.limit_K), summary.limit_K,
                                 peak.value > summary.limit_K ? "" : "not ");
  text += summary.time_to_95_percent_s
              ? ", 95 % after " + milliseconds(*summary.time_to_95_percent_s)
              : std::string(summary.peak_true_max_K ? ", 95 % never reached" : "");
  return text;
}

// Why the peak is held below the reference: the limit's quantile given the remaining uncertainty.
std::string reason(const RunLog& log, const RunSummary& summary, double reference) {
  if (!summary.chance || log.empty()) return "";
  const double aim = chance_aim(log, summary, log.cycles() - 1);
  if (!(aim < reference)) return "";
  return fmt::format(
      " The limit is to hold with {:.6g} % probability and the peak has a standard deviation of "
      "{:.2g} % by the "
      "end, which allows {:.1f} K.",
      100.0 * (1.0 - summary.chance->limit_probability),
      100.0 * log.peak_sigma_K.back() / log.peak_estimate_K.back(), aim);
}

double highest(const std::vector<double>& values) {
  double result = NAN;
  for (const double value : values)
    if (std::isfinite(value) && !(value <= result)) result = value;
  return result;
}

}  // namespace

double chance_aim(const RunLog& log, const RunSummary& summary, std::size_t cycle) {
  if (!summary.chance) return NAN;
  const double relative = log.peak_sigma_K[cycle] / log.peak_estimate_K[cycle];
  return summary.limit_K * std::exp(-summary.chance->kept_deviations * relative);
}

std::string decisive(double value, double limit) {
  for (int digits = 1; digits < 9; ++digits) {
    const double shown = std::round(value * std::pow(10.0, digits)) / std::pow(10.0, digits);
    if ((shown > limit) == (value > limit) && (shown == limit) == (value == limit))
      return fmt::format("{:.{}f}", value, digits);
  }
  return fmt::format("{}", value);
}

Verdict judge(const RunLog& log, const RunSummary& summary, const RunConfig& config) {
  const double reference = config.peak_reference_K;
  const Peak peak = known_peak(summary);
  const std::int64_t violations = summary.limit_violations.value_or(0);
  if (summary.stopped_for) {
    const double end = log.empty() ? 0.0 : log.time_s.back();
    std::string text =
        fmt::format("Stopped after {} ({}): {}", plural(summary.cycles, "cycle", "cycles"),
                    milliseconds(end), *summary.stopped_for);
    text += text.ends_with('.') ? " " : ". ";
    if (violations > 0)
      text += fmt::format("The limit was exceeded in {}. ", plural(violations, "cycle", "cycles"));
    std::string known = facts(summary);
    known[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(known[0])));
    return {"■", "Stopped", text + known + ".", true};
  }
  if (violations > 0 || (peak.value > summary.limit_K))
    return {"▲", "Limit exceeded",
            fmt::format("Limit of {:g} K exceeded{}: {} {} K.", summary.limit_K,
                        violations > 0 ? " in " + plural(violations, "cycle", "cycles") : "",
                        peak.name, decisive(peak.value, summary.limit_K)),
            true};
  const bool reached = summary.peak_true_max_K ? summary.time_to_95_percent_s.has_value()
                                               : photocoag::reached(peak.value, reference);
  const bool steady = summary.rms_error_after_50_ms_K.value_or(0.0) <= 0.05 * reference;
  const std::string by = summary.peak_true_max_K ? "" : ", by the estimate";
  if (!reached)
    return {"○", "Not reached",
            fmt::format("Did not reach {:g} K{}: {}.{}", reference, by, facts(summary),
                        reason(log, summary, reference)),
            false};
  if (!steady)
    return {"○", "Not held",
            fmt::format("Reached but did not hold {:g} K (RMS error {:.2f} K): {}.{}", reference,
                        *summary.rms_error_after_50_ms_K, facts(summary),
                        reason(log, summary, reference)),
            false};
  return {"✓", "Held",
          fmt::format("Held {:g} K{}: {}.{}", reference, by, facts(summary),
                      reason(log, summary, reference)),
          false};
}

std::vector<std::string> contradictions(const RunLog& log, const RunSummary& summary) {
  std::vector<std::string> found;
  const auto compare = [&found](std::string_view name, double in_log, double in_summary,
                                double tolerance) {
    if (!(std::abs(in_log - in_summary) <= tolerance))
      found.push_back(
          fmt::format("{}: run.csv gives {:g}, summary.json says {:g}.", name, in_log, in_summary));
  };
  compare("cycles", static_cast<double>(log.cycles()), static_cast<double>(summary.cycles), 0.0);
  if (log.empty()) return found;
  // A log may be written with fewer digits than the summary.
  constexpr double kDigits = 0.005;
  if (log.has_truth() && summary.peak_true_max_K)
    compare("peak_true_max_K", highest(log.peak_true_K), *summary.peak_true_max_K, kDigits);
  if (summary.peak_estimate_max_K)
    compare("peak_estimate_max_K", highest(log.peak_estimate_K), *summary.peak_estimate_max_K,
            kDigits);
  if (log.has_truth() && summary.limit_violations)
    compare("limit_violations",
            static_cast<double>(std::count_if(log.peak_true_K.begin(), log.peak_true_K.end(),
                                              [&](double y) { return y > summary.limit_K; })),
            static_cast<double>(*summary.limit_violations), 0.0);
  return found;
}

}  // namespace photocoag
