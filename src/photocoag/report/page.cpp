#include "photocoag/report/page.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "photocoag/core/build_info.hpp"
#include "photocoag/report/html.hpp"
#include "photocoag/report/plot.hpp"
#include "photocoag/report/verdict.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;
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

std::string head(const Verdict& verdict) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\">\n<title>{}</title>\n<style>\n{}{}</style>\n</head>\n",
      escape_html(verdict.name + " – photocoag treatment report"), plot_css(SvgKind::kInline),
      page_css());
}

void tile(std::string& html, std::string_view name, const std::string& value,
          const std::string& note) {
  fmt::format_to(Out(html), "<div><dt>{}</dt><dd>{}<small>{}</small></dd></div>\n", name,
                 escape_html(value), escape_html(note));
}

// The four numbers that one asks for first.
std::string tiles(const RunLog& log, const RunSummary& summary, const RunConfig& config) {
  std::string html = "<dl class=\"tiles\">\n";
  const bool truth = summary.peak_true_max_K.has_value();
  const auto peak = truth ? summary.peak_true_max_K : summary.peak_estimate_max_K;
  std::string note = "no value";
  if (peak) {
    const double margin = summary.limit_K - *peak;
    note = quantity(std::abs(margin), 2, "K") + (margin < 0.0 ? " over" : " below") + " the limit";
  }
  tile(html, truth ? "Highest peak rise" : "Highest estimated peak rise", quantity(peak, 2, "K"),
       note);
  std::optional<double> time_ms;
  if (summary.time_to_95_percent_s) time_ms = 1e3 * *summary.time_to_95_percent_s;
  tile(html, "Time to 95 %", time_ms ? fmt::format("{:.4g}\u00a0ms", *time_ms) : "–",
       fmt::format("of {:g}\u00a0K{}", config.peak_reference_K,
                   time_ms || !truth ? "" : ", never reached"));
  tile(html, "RMS error", quantity(summary.rms_error_after_50_ms_K, 3, "K"),
       "after 50 ms, true peak");
  const bool known = log.has_truth() && config.absorption_true;
  tile(html, "Absorption factor",
       log.empty() ? "–" : quantity(log.absorption_estimate.back(), 3, ""),
       log.empty() ? "no estimate"
                   : fmt::format("± {} (2 σ){}", quantity(2.0 * log.absorption_sigma.back(), 3, ""),
                                 known ? fmt::format(", true {:g}", *config.absorption_true) : ""));
  return html + "</dl>\n";
}

std::string figures_section(const std::vector<FigureColumn>& columns) {
  if (columns.empty())
    return "<section><h2>Course of the treatment</h2><p>No cycle was run.</p></section>\n";
  std::string html =
      fmt::format("<section><h2>Course of the treatment</h2>\n<div class=\"columns count-{}\">\n",
                  columns.size());
  for (const FigureColumn& column : columns) {
    fmt::format_to(Out(html), "<div class=\"column\"><h3>{}</h3>\n{}</div>\n",
                   escape_html(column.heading), page_detail::stack(column));
  }
  return html + "</div></section>\n";
}

std::string field_section(const FieldPicture& field) {
  if (field.wide.empty()) return {};
  return fmt::format(
      "<section><h2>Temperature field at the highest peak</h2>\n<div class=\"columns count-2\">\n"
      "<div class=\"column\"><figure><div class=\"wide\">{}</div><div class=\"narrow\">{}</div>"
      "</figure></div>\n<div class=\"column\"><p class=\"hint\">A cut through the simulated eye; "
      "light comes from above. Lines of equal temperature rise at the end of the cycle with the "
      "highest true peak. All cells are in <code>field.vtr</code> of the run folder, for ParaView; "
      "<code>./photocoag field --run</code> gives other instants.</p></div></div></section>\n",
      field.wide, field.narrow);
}

std::string reproduce_section(const RunSummary& summary, const RunConfig& config,
                              const std::string& folder) {
  // A device's noise and lateness come once: what can be had again is what was made of them.
  const bool device = summary.device.has_value();
  const std::string command =
      device ? "./photocoag replay " + shell_word(folder)
             : "./photocoag simulate --config " + shell_word(folder + "/config.toml");
  const std::string_view promise =
      device ? "The recorded samples and this program give the same powers again:"
             : "The same configuration, seed and program give the same log:";
  return fmt::format(
      "<section><h2>Reproduce</h2>\n<p>{}</p>\n<pre class=\"command\"><code>{}</code></pre>\n"
      "<dl class=\"facts\"><div><dt>Program</dt><dd>photocoag {}</dd></div>\n"
      "<div><dt>Seed</dt><dd>{}</dd></div>\n"
      "<div><dt>Configuration, SHA-256</dt><dd class=\"hash\">{}</dd></div></dl>\n"
      "<details><summary>Configuration</summary>\n<pre class=\"config\" "
      "tabindex=\"0\"><code>{}</code></pre></details>\n",
      promise, escape_html(command), escape_html(summary.version), escape_html(summary.seed),
      escape_html(summary.config_sha256), escape_html(config.text));
}

}  // namespace

std::string page_detail::stack(const FigureColumn& column) {
  std::string html = "<div class=\"stack\">\n";
  for (std::size_t k = 0; k < column.wide.size(); ++k)
    fmt::format_to(Out(html),
                   "<figure><div class=\"wide\">{}</div><div class=\"narrow\">{}</div></figure>\n",
                   column.wide[k], column.narrow[k]);
  return html + "</div>";
}

std::string report_page(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                        const std::vector<FigureColumn>& figures, const FieldPicture& field,
                        const FigureColumn& histograms, const std::string& folder) {
  const Verdict verdict = judge(log, summary, config);
  std::string html = head(verdict);
  fmt::format_to(
      Out(html),
      "<body>\n<main>\n<header>\n<p class=\"kicker\">photocoag · treatment report</p>\n"
      "<h1><span class=\"badge{}\" aria-hidden=\"true\">{}</span> <span "
      "class=\"verdict\">{}</span></h1>\n"
      "<p class=\"run\">{} · seed {} · <span class=\"path\">{}</span></p>\n"
      "<p class=\"notice\">{}</p>\n</header>\n",
      verdict.alarm ? " alarm" : "", verdict.symbol, escape_html(keep_units(verdict.text)),
      summary.peak_true_max_K ? "Simulated eye" : "Eye not simulated: true temperatures unknown",
      escape_html(summary.seed), escape_html(folder), kResearchNotice);
  for (const std::string& sentence : contradictions(log, summary))
    fmt::format_to(Out(html),
                   "<p class=\"warning\"><strong>Log and summary disagree.</strong> {}</p>\n",
                   escape_html(sentence));
  html += tiles(log, summary, config);
  html += figures_section(figures);
  html += field_section(field);
  html += page_detail::summary_section(log, summary, config);
  html += page_detail::timing_section(summary, histograms);
  html += reproduce_section(summary, config, folder);
  if (!log.empty())
    html += "<details><summary>First 10 and last 3 cycles</summary>\n" +
            page_detail::cycles_table(log) +
            "<p class=\"hint\">All cycles are in <code>run.csv</code> of the run folder: each row "
            "has the power applied during the cycle, and the temperatures and estimates at its "
            "end.</p></details>\n";
  html += "</section>\n";
  fmt::format_to(Out(html), "<footer><p>{}</p></footer>\n</main>\n</body>\n</html>\n",
                 kResearchNotice);
  return html;
}

}  // namespace photocoag
