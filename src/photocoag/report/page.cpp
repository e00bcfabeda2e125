#include "photocoag/report/page.hpp"

#include <fmt/format.h>

#include <cmath>

#include "photocoag/core/build_info.hpp"
#include "photocoag/report/verdict.hpp"

namespace photocoag {
namespace {

using page_detail::quantity;

// No line break between a number and its unit.
std::string keep_units(std::string text) {
  for (const std::string_view unit : {" K", " ms", " %", " °C"})
    for (std::size_t at = text.find(unit); at != std::string::npos; at = text.find(unit, at + 1)) {
      const char before = at > 0 ? text[at - 1] : ' ';
      if (before >= '0' && before <= '9') text.replace(at, 1, "\u00a0");
    }
  return text;
}

// A word for a shell: quoted if it has to be.
std::string shell_word(const std::string& text) {
  const bool plain = text.find_first_not_of(
                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                         "/._-+=:,@%") == std::string::npos;
  if (plain && !text.empty()) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

// The four key numbers.
Html first_numbers(const RunLog& log, const RunSummary& summary, const RunConfig& config) {
  const bool truth = summary.peak_true_max_K.has_value();
  const auto peak = truth ? summary.peak_true_max_K : summary.peak_estimate_max_K;
  std::string margin = "no value";
  if (peak) {
    const double below = summary.limit_K - *peak;
    margin = quantity(std::abs(below), 2, "K") + (below < 0.0 ? " over" : " below") + " the limit";
  }
  std::optional<double> time_ms;
  if (summary.time_to_95_percent_s) time_ms = 1e3 * *summary.time_to_95_percent_s;
  const bool known = log.has_truth() && config.absorption_true;
  const std::string truth_of_alpha =
      known ? fmt::format(", true {:g}", *config.absorption_true) : "";
  return tiles(
      {{truth ? "Highest peak rise" : "Highest estimated peak rise", quantity(peak, 2, "K"),
        margin},
       {"Time to 95 %", time_ms ? fmt::format("{:.4g}\u00a0ms", *time_ms) : "–",
        fmt::format("of {:g}\u00a0K{}", config.peak_reference_K,
                    time_ms || !truth ? "" : ", never reached")},
       {"RMS error", quantity(summary.rms_error_after_50_ms_K, 3, "K"), "after 50 ms, true peak"},
       {"Absorption factor", log.empty() ? "–" : quantity(log.absorption_estimate.back(), 3, ""),
        log.empty() ? "no estimate"
                    : "± " + quantity(2.0 * log.absorption_sigma.back(), 3, "") + " (2 σ)" +
                          truth_of_alpha}});
}

Html figures_section(const std::vector<FigureColumn>& parts) {
  const std::string_view heading = "Course of the treatment";
  if (parts.empty()) return section(heading, element("p", "No cycle was run."));
  Html columns;
  for (const FigureColumn& part : parts)
    columns += element("div.column", {element("h3", part.heading), stack(part.figures)});
  return section(heading, element(fmt::format("div.columns.count-{}", parts.size()), columns));
}

Html field_section(const Figure& field) {
  const Html words = element(
      "p.hint",
      {"A cut through the simulated eye; light comes from above. Lines of equal temperature rise "
       "at the end of the cycle with the highest true peak. All cells are in ",
       element("code", "field.vtr"), " of the run folder, for ParaView; ",
       element("code", "./photocoag field --run"), " gives other instants."});
  return section("Temperature field at the highest peak",
                 element("div.columns.count-2", {element("div.column", figure_element(field)),
                                                 element("div.column", words)}));
}

Html reproduce_section(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                       const std::string& folder) {
  // A device's noise and timing cannot be repeated; only the controller's response to them can.
  const bool device = summary.device.has_value();
  const std::string command =
      device ? "./photocoag replay " + shell_word(folder)
             : "./photocoag simulate --config " + shell_word(folder + "/config.toml");
  const auto fact = [](std::string_view name, const Html& value) {
    return element("div", {element("dt", name), value});
  };
  Html content =
      element("p", device ? "The recorded samples and this program give the same powers again:"
                          : "The same configuration, seed and program give the same log:") +
      element("pre.command", element("code", command)) +
      element("dl.facts",
              {fact("Program", element("dd", "photocoag " + summary.version)),
               fact("Seed", element("dd", summary.seed)),
               fact("Configuration, SHA-256", element("dd.hash", summary.config_sha256))}) +
      unfold("Configuration", config.text);
  if (!log.empty())
    content += element(
        "details",
        {element("summary", "First 10 and last 3 cycles"), page_detail::cycles_table(log),
         element("p.hint", {"All cycles are in ", element("code", "run.csv"),
                            " of the run folder: each row has the power applied during the cycle, "
                            "and the temperatures and estimates at its end."})});
  return section("Reproduce", content);
}

}  // namespace

std::string report_page(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                        const std::vector<FigureColumn>& parts, const std::optional<Figure>& field,
                        const std::vector<Figure>& histograms, const std::string& folder) {
  const Verdict verdict = judge(log, summary, config);
  PageHead head{.title = verdict.name, .kicker = "treatment report"};
  head.headline = element(verdict.alarm ? "span.badge.alarm" : "span.badge", verdict.symbol,
                          {{"aria-hidden", "true"}}) +
                  " " + element("span.verdict", keep_units(verdict.text));
  head.line =
      Html(fmt::format("{} · seed {} · ",
                       summary.peak_true_max_K ? "Simulated eye"
                                               : "Eye not simulated: true temperatures unknown",
                       summary.seed)) +
      element("span.path", folder);
  Html body;
  for (const std::string& sentence : contradictions(log, summary))
    body += element("p.warning", {element("strong", "Log and summary disagree."), " ", sentence});
  if (summary.prior_doubtful)
    body +=
        element("p.warning",
                {element("strong", "This eye does not fit the prior."),
                 " What the samples showed would be this far from ", element("code", "[[prior]]"),
                 " in one of 500 treatments: the stated probability may not hold here."});
  body += first_numbers(log, summary, config) + figures_section(parts);
  if (field) body += field_section(*field);
  body += page_detail::summary_section(log, summary, config) +
          page_detail::timing_section(summary, histograms) +
          reproduce_section(log, summary, config, folder);
  return page(head, body);
}

}  // namespace photocoag
