#include "photocoag/mpc/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "photocoag/core/check.hpp"
#include "photocoag/core/setting.hpp"

namespace photocoag {
namespace {

void require_valid_reference(const ControlSettings& s) {
  require(
      s.reference_times.size() == s.reference_values.size(), "control.reference_K",
      fmt::format("{} numbers", s.reference_values.size()),
      fmt::format("one for each of the {} control.reference_times_ms", s.reference_times.size()));
  double last = -1.0;
  for (const double time : s.reference_times) {
    require(time > last, "control.reference_times_ms", time * 1e3,
            "ascending times from 0 to 60000 ms");
    last = time;
  }
  for (const double value : s.reference_values) {
    require(value < s.peak_max, "control.reference_K", value,
            fmt::format("above 0, below the limit control.peak_max_K = {} K", s.peak_max));
  }
}

void require_valid_chance(const ControlSettings& s) {
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

std::vector<Field> fields_of(ControlSettings& s) {
  using namespace units;
  FieldTable table("control");
  table.number("period_ms", s.period, kMilliseconds, {0.05, 100}, "control period T");
  table.integer("horizon", s.horizon, 2, 50, "N, periods looked ahead, with N - 1 free inputs");
  table.number("peak_reference_K", s.peak_reference, kKelvin, {0, 150, true},
               "peak temperature rise to hold, below peak_max_K");
  table.number("peak_max_K", s.peak_max, kKelvin, {0, 150, true},
               "limit of the predicted peak temperature rise");
  table.number("power_max_W", s.power_max, kWatt, {0, 1, true, "0.1 W is 100 mW"},
               "largest laser power; 0.1 W is 100 mW");
  table.number("power_min_W", s.power_min, kWatt, {0, 1},
               "smallest laser power, below power_max_W");
  table.word("state_weight", s.state_weight, {"constant", "delayed"},
             "R0 = 1, or R0(j) = 0 for j = n+k in {1, 2, 3}, which needs a weight below");
  table.number("power_weight", s.power_weight, {"K2/W2"}, {0, 1e9},
               "R1, on power against its steady value");
  table.number("power_change_weight", s.power_change_weight, {"K2/W2"}, {0, 1e9},
               "R2, on the change of power");
  table.numbers("reference_times_ms", s.reference_times, kMilliseconds, {0, 60000},
                "ascending; of reference_K. Both empty: peak_reference_K throughout");
  table.numbers("reference_K", s.reference_values, kKelvin, {0, 150, true},
                "references at these times, linear between, constant beyond the last");
  table.word(
      "robust", s.robust, {"none", "certified", "chance"},
      "certified: the limit holds for the estimate plus robust_sigma deviations and the "
      "model's proved error; chance: it holds except with limit_probability, given [[prior]]");
  table.number("robust_sigma", s.robust_sigma, kOne, {0, 10}, "standard deviations");
  table.number("limit_probability", s.limit_probability, kOne, {1e-6, 0.5},
               "with robust \"chance\": probability that a treatment exceeds peak_max_K");
  table.number("identification_ms", s.identification_duration, kMilliseconds, {0, 60000},
               "the longest gentle start, with robust \"chance\"; 0: none");
  table.number("identification_power_W", s.identification_power, kWatt, {0, 1, true},
               "highest power during that start");
  table.number("identification_sigma_K", s.identification_sigma, kKelvin, {0, 50},
               "it ends once the peak at the reference is known to this standard deviation; 0: by "
               "time only");
  table.integer("delay_cycles", s.delay, 0, 1,
                "periods from a sample to the power computed from it");
  table.integer("solve_every", s.solve_every, 1, 49,
                "periods from one solution to the next, below horizon; its plan in between");
  table.number(
      "first_power_W", s.first_power, kWatt, {0, 1},
      "power of the first period, prescribed: 0.02 in the paper's experiments; 0: solved for");
  table.word("solver", s.solver, {"dense", "osqp", "osqp-condensed"},
             "of the quadratic program: exact, or the paper's OSQP on the sparse or the condensed "
             "problem");
  table.number("osqp_tolerance", s.osqp_tolerance, kOne, {1e-6, 0.1},
               "absolute and relative tolerance of OSQP; its default is 1e-3");
  return table.take();
}

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
  ControlSettings own = *this;
  require_in_range(fields_of(own));
  require(peak_reference < peak_max, "control.peak_reference_K", peak_reference,
          fmt::format("below the limit control.peak_max_K = {} K", peak_max));
  require(power_min < power_max, "control.power_min_W", power_min,
          fmt::format("from 0 to below control.power_max_W = {} W", power_max));
  require_valid_reference(*this);
  for (const double share : shares) {
    require(share > 0.0 && share <= 1.0, "control.shares", share, "above 0, at most 1");
  }
  require(solve_every < horizon, "control.solve_every", solve_every,
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
    // The first inputs are then weighted by R1 and R2 alone: without them u0 is not unique. Below
    // the floor it is unique only in exact arithmetic (the outputs' own scale is about 100 K2).
    const double floor = 1e-6 / (power_max * power_max);
    require(power_weight + power_change_weight >= floor, "control.state_weight",
            std::string_view("delayed with power_weight + power_change_weight too small"),
            fmt::format("delayed with power_weight + power_change_weight of at least {:g} K2/W2",
                        floor));
  }
}

}  // namespace photocoag
