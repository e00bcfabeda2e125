#include "photocoag/mpc/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "photocoag/core/check.hpp"

namespace photocoag {
namespace {

void require_valid_reference(const ControlSettings& s) {
  require(
      s.reference_times.size() == s.reference_values.size(), "control.reference_K",
      fmt::format("{} numbers", s.reference_values.size()),
      fmt::format("one for each of the {} control.reference_times_ms", s.reference_times.size()));
  double last = -1.0;
  for (const double time : s.reference_times) {
    require(time >= 0.0 && time <= 60.0 && time > last, "control.reference_times_ms", time * 1e3,
            "ascending times from 0 to 60000 ms");
    last = time;
  }
  for (const double value : s.reference_values) {
    require(value > 0.0 && value < s.peak_max, "control.reference_K", value,
            fmt::format("above 0, below the limit control.peak_max_K = {} K", s.peak_max));
  }
}

void require_valid_chance(const ControlSettings& s) {
  require_between(s.limit_probability, 1e-6, 0.5, "control.limit_probability");
  require_between(s.identification_duration * 1e3, 0.0, 60000.0, "control.identification_ms");
  require(s.identification_power > 0.0 && s.identification_power <= 1.0,
          "control.identification_power_W", s.identification_power,
          "a number above 0, at most 1 W");
  require_between(s.identification_sigma, 0.0, 50.0, "control.identification_sigma_K");
  const bool chance = s.robust == Robustness::kChance;
  require(chance || s.identification_duration == 0.0, "control.identification_ms",
          s.identification_duration * 1e3, "0, or control.robust = \"chance\"");
  if (s.identification_duration > 0.0) {
    require(s.identification_power >= s.power_min && s.identification_power <= s.power_max,
            "control.identification_power_W", s.identification_power,
            fmt::format("from control.power_min_W = {} to control.power_max_W = {}", s.power_min,
                        s.power_max));
  }
  if (!chance) return;
  require(s.solver == SolverKind::kDense, "control.solver", std::string_view("osqp"),
          "dense with control.robust = \"chance\"");
  require(s.solve_every == 1, "control.solve_every", s.solve_every,
          "1 with control.robust = \"chance\"");
}

}  // namespace

double ControlSettings::reference_at(double time) const noexcept {
  if (reference_times.empty()) return peak_reference;
  std::size_t next = 0;
  while (next < reference_times.size() && reference_times[next] <= time) ++next;
  if (next == 0) return reference_values.front();
  if (next == reference_times.size()) return reference_values.back();
  const double share =
      (time - reference_times[next - 1]) / (reference_times[next] - reference_times[next - 1]);
  return reference_values[next - 1] + share * (reference_values[next] - reference_values[next - 1]);
}

double ControlSettings::share_at(long long n) const noexcept {
  if (shares.empty()) return 1.0;
  const auto last = static_cast<long long>(shares.size());
  return shares[static_cast<std::size_t>(std::clamp(n, 1LL, last) - 1)];
}

void ControlSettings::validate() const {
  require_between(period * 1e3, 0.05, 100.0, "control.period_ms");
  require(horizon >= 2 && horizon <= 50, "control.horizon", horizon, "an integer from 2 to 50");
  require_positive(peak_reference, 150.0, "control.peak_reference_K");
  require_positive(peak_max, 150.0, "control.peak_max_K");
  require(peak_reference < peak_max, "control.peak_reference_K", peak_reference,
          fmt::format("below the limit control.peak_max_K = {} K", peak_max));
  require(power_max > 0.0 && power_max <= 1.0, "control.power_max_W", power_max,
          "a power in watts above 0, at most 1 (0.1 W is 100 mW)");
  require_between(power_min, 0.0, 1.0, "control.power_min_W");
  require(power_min < power_max, "control.power_min_W", power_min,
          fmt::format("from 0 to below control.power_max_W = {} W", power_max));
  require_between(power_weight, 0.0, 1e9, "control.power_weight");
  require_between(power_change_weight, 0.0, 1e9, "control.power_change_weight");
  require_between(osqp_tolerance, 1e-6, 0.1, "control.osqp_tolerance");
  require_valid_reference(*this);
  for (const double share : shares) {
    require(share > 0.0 && share <= 1.0, "control.shares", share, "above 0, at most 1");
  }
  require_between(robust_sigma, 0.0, 10.0, "control.robust_sigma");
  require(delay == 0 || delay == 1, "control.delay_cycles", delay, "0 or 1");
  require(solve_every >= 1 && solve_every < horizon, "control.solve_every", solve_every,
          fmt::format("from 1 to below control.horizon = {}", horizon));
  require(first_power == 0.0 || (first_power >= power_min && first_power <= power_max),
          "control.first_power_W", first_power,
          fmt::format("0, or from control.power_min_W = {} to control.power_max_W = {} W",
                      power_min, power_max));
  require(solver != SolverKind::kOsqp || (robust == Robustness::kNone && solve_every == 1),
          "control.solver", std::string_view("osqp"),
          "dense or osqp-condensed with control.robust or control.solve_every");
  require_valid_chance(*this);
  if (state_weight == StateWeight::kDelayed) {
    // The first inputs are then scored by R1 and R2 alone: without them u0 is not unique. Below the
    // floor it is unique on paper only (the outputs' own scale is some 100 K2).
    const double floor = 1e-6 / (power_max * power_max);
    require(power_weight + power_change_weight >= floor, "control.state_weight",
            std::string_view("delayed with power_weight + power_change_weight too small"),
            fmt::format("delayed with power_weight + power_change_weight of at least {:g} K2/W2",
                        floor));
  }
}

}  // namespace photocoag
