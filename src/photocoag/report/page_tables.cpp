// The tables of the page.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/report/page.hpp"

namespace photocoag::page_detail {
namespace {

constexpr std::string_view kNone = "–";
constexpr std::string_view kSpace = "\u00a0";  // keeps number and unit together

std::string count(std::optional<std::int64_t> value) {
  return value ? fmt::format("{}", *value) : std::string(kNone);
}

class KeyTable {
 public:
  explicit KeyTable(std::string_view caption) : caption_(caption) {}
  KeyTable& row(std::string_view name, std::string_view value, std::string_view note = "",
                bool alarm = false) {
    Html words(name);
    if (!note.empty()) words += element("small", note);
    rows_ += element(alarm ? "tr.alarm" : "tr",
                     {element("th", words, {{"scope", "row"}}), element("td", value)});
    return *this;
  }
  // A row for text that is too long for the second column.
  KeyTable& alarm(std::string_view name, std::string_view words) {
    rows_ += element("tr.alarm", element("th", fmt::format("{}: {}", name, words),
                                         {{"scope", "row"}, {"colspan", "2"}}));
    return *this;
  }
  Html end() const {
    return element("table.keys", {element("caption", caption_), element("tbody", rows_)});
  }

 private:
  std::string_view caption_;
  Html rows_;
};

std::optional<double> finite(double value) {
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<double> plus(std::optional<double> value, double more) {
  return value ? std::optional(*value + more) : std::nullopt;
}

Html temperature_table(const RunSummary& summary, const RunConfig& config) {
  const std::string ambient = fmt::format("absolute, ambient {:g}{}°C", config.ambient_C, kSpace);
  KeyTable table("Temperature");
  table.row("Reference", fmt::format("{:g}{}K", config.peak_reference_K, kSpace), "peak rise");
  table.row("Limit", fmt::format("{:g}{}K", summary.limit_K, kSpace), "peak rise");
  if (summary.peak_true_max_K)
    table.row("Highest peak", quantity(summary.peak_true_max_K, 2, "K"), "true rise")
        .row("Highest peak", quantity(plus(summary.peak_true_max_K, config.ambient_C), 2, "°C"),
             ambient);
  if (summary.device && summary.device->pulse_peak_true_max_K)
    table.row("Highest instant", quantity(summary.device->pulse_peak_true_max_K, 2, "K"),
              "true rise, right after a pulse");
  table.row("Highest estimated peak", quantity(summary.peak_estimate_max_K, 2, "K"), "rise");
  if (!summary.peak_true_max_K)
    table.row("Highest estimated peak",
              quantity(plus(summary.peak_estimate_max_K, config.ambient_C), 2, "°C"), ambient);
  table.row("RMS error after 50 ms", quantity(summary.rms_error_after_50_ms_K, 3, "K"),
            "true peak against reference");
  std::optional<double> time_ms;
  if (summary.time_to_95_percent_s) time_ms = 1e3 * *summary.time_to_95_percent_s;
  const std::string_view without = summary.peak_true_max_K ? "never" : kNone;
  table.row("Time to 95 %",
            time_ms ? fmt::format("{:.4g}{}ms", *time_ms, kSpace) : std::string(without),
            "of the reference");
  return table.end();
}

// "schlott_2012" -> "Schlott 2012"
std::string proper_name(std::string name) {
  bool start = true;
  for (char& letter : name) {
    if (letter == '_') letter = ' ';
    if (start && letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
    start = letter == ' ';
  }
  return name;
}

Html dose_table(const RunSummary& summary) {
  if (summary.thermal_dose.empty()) return {};
  KeyTable table("Thermal dose at the peak");
  for (const auto& [name, dose] : summary.thermal_dose)
    table.row(proper_name(name), fmt::format("{:#.2g}", dose), "Arrhenius integral, damage at 1");
  return table.end();
}

Html safety_table(const RunSummary& summary) {
  KeyTable table("Limit and stop");
  const bool exceeded = summary.limit_violations.value_or(0) > 0;
  table
      .row(exceeded ? "▲ Cycles over the limit" : "Cycles over the limit",
           count(summary.limit_violations), "true peak", exceeded)
      .row("Limit active", count(summary.limit_active_cycles), "cycles in which it bound the power")
      .row("Overruns", count(summary.overruns), "cycles that ended late");
  if (summary.device && summary.device->late_commands) {
    table.row("Commands late", count(summary.device->late_commands),
              "cycles with an older power in force");
  }
  if (summary.stopped_for) {
    table.alarm("■ Stopped for", *summary.stopped_for);
  } else {
    table.row("Stopped for", "nothing", "ran to the end");
  }
  return table.end();
}

Html laser_table(const RunLog& log, const RunConfig& config) {
  KeyTable table("Laser");
  const double longest =
      log.empty() ? 0.0 : *std::max_element(log.power_W.begin(), log.power_W.end());
  table.row("Energy", quantity(log.energy_J(), 6, "J"), "commanded power × period")
      .row("Highest power", quantity(1e3 * longest, 2, "mW"))
      .row("Power bound", fmt::format("{:g}{}mW", 1e3 * config.power_max_W, kSpace));
  return table.end();
}

Html absorption_table(const RunLog& log, const RunSummary& summary, const RunConfig& config) {
  KeyTable table("Absorption factor");
  if (!log.empty()) {
    table.row("Final estimate", quantity(finite(log.absorption_estimate.back()), 4, ""))
        .row("Uncertainty", "±" + quantity(finite(2.0 * log.absorption_sigma.back()), 4, ""),
             "2 σ, as the estimator sees it");
  }
  if (log.has_truth() && config.absorption_true)
    table.row("Truth", fmt::format("{:g}", *config.absorption_true), "of the simulated eye");
  std::optional<double> percent;
  if (summary.absorption_error_final) percent = 100.0 * *summary.absorption_error_final;
  table.row("Final error", quantity(percent, 2, "%"), "estimate ∕ truth − 1");
  if (summary.choroid_error_final && !log.empty()) {
    table
        .row("Choroid factor", quantity(finite(log.choroid_estimate.back()), 4, ""),
             fmt::format("final estimate{}", config.choroid_true
                                                 ? fmt::format(", truth {:g}", *config.choroid_true)
                                                 : ""))
        .row("Its uncertainty", "±" + quantity(finite(2.0 * log.choroid_sigma.back()), 4, ""),
             "2 σ")
        .row("Its final error", quantity(100.0 * *summary.choroid_error_final, 2, "%"));
  }
  return table.end();
}

Html run_table(const RunLog& log, const RunSummary& summary) {
  KeyTable table("Run");
  table.row("Cycles", fmt::format("{}", summary.cycles));
  if (!log.empty())
    table.row("Control period", fmt::format("{:g}{}ms", 1e3 * log.period_s(), kSpace))
        .row("Duration", fmt::format("{:g}{}ms", 1e3 * log.time_s.back(), kSpace));
  table.row("Seed", summary.seed)
      .row("Full-order model", count(summary.full_order_states), "states");
  return table.end();
}

Html solver_table(const RunLog& log) {
  std::vector<std::pair<std::string, std::int64_t>> counts;
  for (const std::string& status : log.solver_status) {
    auto found = std::find_if(counts.begin(), counts.end(),
                              [&](const auto& entry) { return entry.first == status; });
    if (found == counts.end()) found = counts.insert(counts.end(), {status, 0});
    ++found->second;
  }
  KeyTable table("Solver");
  for (const auto& [status, cycles] : counts)
    table.row(status.empty() ? "no status" : status, fmt::format("{}", cycles), "cycles");
  double most = 0.0;
  for (const double iterations : log.solver_iterations)
    if (iterations > most) most = iterations;
  table.row("Most iterations", fmt::format("{:g}", most), "in one cycle");
  return table.end();
}

// Three to four significant digits, never an exponent in the usual range.
std::string short_number(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e9) return fmt::format("{:.0f}", value);
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size >= 100.0 ? 0 : size >= 10.0 ? 1 : size >= 1.0 ? 2 : 3);
}

}  // namespace

std::pair<std::string, std::string> name_and_unit(std::string name) {
  std::string unit;
  const std::size_t last = name.rfind('_');
  if (last != std::string::npos) {
    for (const auto& [ending, shown] :
         {std::pair("us", "µs"), {"ms", "ms"}, {"ns", "ns"}, {"s", "s"}})
      if (name.substr(last + 1) == ending) unit = shown;
    if (!unit.empty()) name.erase(last);
  }
  std::replace(name.begin(), name.end(), '_', ' ');
  return {name, unit};
}

std::string quantity(std::optional<double> value, int digits, std::string_view unit) {
  if (!value || !std::isfinite(*value)) return std::string(kNone);
  std::string number = fmt::format("{:.{}f}", std::abs(*value), digits);
  const bool zero = number.find_first_not_of("0.") == std::string::npos;
  std::string text = *value < 0.0 && !zero ? "−" : "";
  text += number;
  if (!unit.empty()) {
    text += kSpace;
    text += unit;
  }
  return text;
}

Html summary_section(const RunLog& log, const RunSummary& summary, const RunConfig& config) {
  return section(
      "Summary",
      element("div.tables",
              {element("div", {temperature_table(summary, config), dose_table(summary)}),
               element("div", {safety_table(summary), absorption_table(log, summary, config)}),
               element("div",
                       {laser_table(log, config), run_table(log, summary), solver_table(log)})}));
}

Html timing_section(const RunSummary& summary, const std::vector<Figure>& histograms) {
  if (summary.timing.empty()) {
    if (!summary.device || summary.device->pacing.empty()) return {};
    return section("Timing",
                   element("p", "The simulated eye was paced " + summary.device->pacing + "."));
  }
  std::vector<std::string> columns;
  for (const RunSummary::Timing& row : summary.timing)
    for (const auto& [name, value] : row.values)
      if (std::find(columns.begin(), columns.end(), name) == columns.end()) columns.push_back(name);
  Table times{.head = {"Time"}, .rows = {}};
  for (const std::string& name : columns) times.head.push_back(name_and_unit(name).first);
  for (const RunSummary::Timing& row : summary.timing) {
    const auto [name, unit] = name_and_unit(row.name);
    auto& cells = times.rows.emplace_back();
    cells.push_back(unit.empty() ? name : name + " in " + unit);
    for (const std::string& column : columns) {
      const auto found = std::find_if(row.values.begin(), row.values.end(),
                                      [&](const auto& entry) { return entry.first == column; });
      cells.push_back(found == row.values.end() ? std::string(kNone) : short_number(found->second));
    }
  }
  Html content = table(times, "Timing");
  if (!histograms.empty())
    content +=
        element("p.hint",
                "Wake: from the end of the period to the wake-up. Compute: from the sample to the "
                "power, without the eye. Write: until the device has it. Slack: from then to the "
                "next deadline. Where the time of every cycle went, counts logarithmic:") +
        element("div.columns.count-1.histograms", stack(histograms));
  return section("Timing", content);
}

Html cycles_table(const RunLog& log) {
  constexpr std::size_t kFirst = 10, kLast = 3;
  Table cycles{.head = {"cycle", "time\nms", "power\nmW", "u_ref\nmW", "peak true\nK",
                        "peak est.\nK", "volume true\nK", "measured\nK", "estimate\nK",
                        "absorption\nfactor", "σ", "solver", "iterations"},
               .rows = {}};
  const auto cell = [](double value, int digits) { return quantity(finite(value), digits, ""); };
  for (std::size_t k = 0; k < log.cycles(); ++k) {
    if (k >= kFirst && k + kLast < log.cycles()) {
      cycles.rows.emplace_back(cycles.head.size(), "⋯");
      k = log.cycles() - kLast;
    }
    cycles.rows.push_back({fmt::format("{:.0f}", log.cycle[k]), cell(1e3 * log.time_s[k], 2),
                           cell(1e3 * log.power_W[k], 3), cell(1e3 * log.power_reference_W[k], 3),
                           cell(log.peak_true_K[k], 3), cell(log.peak_estimate_K[k], 3),
                           cell(log.volume_true_K[k], 3), cell(log.volume_measured_K[k], 3),
                           cell(log.volume_estimate_K[k], 3), cell(log.absorption_estimate[k], 4),
                           cell(log.absorption_sigma[k], 4), log.solver_status[k],
                           cell(log.solver_iterations[k], 0)});
  }
  return table(cycles, "Cycles");
}

}  // namespace photocoag::page_detail
