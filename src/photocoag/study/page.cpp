// index.html of `reproduce`.
#include <fmt/format.h>

#include <iterator>
#include <set>

#include "photocoag/core/files.hpp"
#include "photocoag/report/html.hpp"
#include "photocoag/study/page_frame.hpp"
#include "photocoag/study/reproduce.hpp"
#include "photocoag/study/timing.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

constexpr std::string_view kCss = R"css(
.claims{width:100%;margin-top:18px}
.claims th,.claims td{border-top:1px solid var(--line);padding:8px 14px 8px 0;text-align:left;vertical-align:top}
.claims thead th{border-top:0;color:var(--quiet);font-weight:400;font-size:.875rem;padding-bottom:2px}
.claims .mark{white-space:nowrap;font-weight:600;width:9rem}
.claims .mark span{display:inline-block;width:1.4em}
.claims .why{color:var(--quiet);font-size:.875rem;margin-top:4px}
.claims ul{margin:0;padding:0;list-style:none;font-size:.875rem}
.claims li code{font-size:.8125rem}
.claims .pred{width:42%}
.claims details{border:0;padding:2px 0}
.claims summary{font-weight:400;color:var(--quiet);font-size:.8125rem}
.claims details code{font-size:.75rem}
.times td,.times th{padding:4px 0 4px 22px;text-align:right;border-top:1px solid var(--line);font-weight:400}
.times tr>:first-child{padding-left:0}
.sens td,.sens th{border-top:1px solid var(--line);padding:4px 10px 4px 0;text-align:center;font-weight:400;font-size:.875rem}
.sens tr>:first-child{text-align:left;min-width:16rem}
.toc{columns:2;font-size:.9375rem;margin:0;padding-left:1.2em}
@media screen and (max-width:640px){.toc{columns:1}.claims .pred{width:auto}}
)css";

std::string_view symbol(Verdict3 verdict) {
  if (verdict == Verdict3::kHolds) return "✓";
  return verdict == Verdict3::kDiffers ? "≠" : "?";
}

void claims_table(std::string& html, const StudyOutcome& outcome) {
  html +=
      "<div class=\"scroll\"><table class=\"claims\"><thead><tr><th>verdict</th><th>what the paper "
      "says</th><th>measured, over the seeds</th></tr></thead>\n";
  for (const JudgedClaim& claim : outcome.claims) {
    fmt::format_to(Out(html), "<tr><td class=\"mark\"><span>{}</span>{}</td><td>{}",
                   symbol(claim.verdict), name_of(claim.verdict), escape_html(claim.claim.text));
    std::string why = claim.verdict == Verdict3::kDiffers       ? claim.claim.differs
                      : claim.verdict == Verdict3::kCannotJudge ? claim.claim.cannot_judge
                                                                : std::string();
    if (claim.verdict == Verdict3::kDiffers && why.empty()) {
      why = "The data contradict the claim; the study's file gives no reason.";
    }
    if (!claim.as_expected()) {
      why += fmt::format(" The study's file expects “{}”: something has changed.",
                         claim.claim.expected);
    }
    if (!why.empty()) fmt::format_to(Out(html), "<p class=\"why\">{}</p>", escape_html(why));
    html += "</td><td class=\"pred\">";
    if (!claim.claim.holds_if.empty()) {
      html += "<ul>";
      std::set<std::string> shown;
      for (const TermValue& term : claim.terms) {
        if (!shown.insert(term.term.text()).second) continue;
        fmt::format_to(Out(html), "<li><code>{}</code> = {}</li>", escape_html(term.term.text()),
                       escape_html(number_text(term.value, unit_of(term.term.measure))));
      }
      fmt::format_to(Out(html),
                     "</ul><details><summary>holds if</summary><code>{}</code></details>",
                     escape_html(claim.claim.holds_if));
    }
    html += "</td></tr>\n";
  }
  html += "</table></div>\n";
}

void times_table(std::string& html, const StudyOutcome& outcome) {
  html +=
      "<div class=\"scroll\"><table class=\"times\"><thead><tr><th>N</th><th>paper, average</th>"
      "<th>paper, maximum</th><th>solver here</th><th>average</th><th>maximum</th><th>first "
      "solve</th><th>worst later solve</th></tr></thead>\n";
  for (const RunResult& run : outcome.results) {
    const PaperTime paper = paper_time(run.config.control.horizon);
    const auto us = [&run](const char* measure, const char* statistic) {
      return statistic_of(statistic, run.measures.at(measure));
    };
    fmt::format_to(Out(html),
                   "<tr><td>{}</td><td>{:.0f} µs</td><td>{:.0f} µs</td><td>{}</td><td>{:.2f} "
                   "µs</td><td>{:.2f} "
                   "µs</td><td>{:.2f} µs</td><td>{:.2f} µs</td></tr>\n",
                   run.config.control.horizon, paper.average_ms * 1e3, paper.maximum_ms * 1e3,
                   run.id.substr(0, run.id.find("_n")), us("solve_mean_us", "mean"),
                   us("solve_max_us", "max"), us("solve_first_us", "median"),
                   us("solve_warm_worst_us", "median"));
  }
  html +=
      "</table></div>\n<p class=\"hint\">Average and maximum over all cycles and treatments, the "
      "machine's interruptions included. First and worst later solve: the least of five "
      "repetitions "
      "of the same solve, median of the treatments. The paper's times are from another "
      "machine.</p>\n";
}

void sensitivity_table(std::string& html, const StudyOutcome& outcome) {
  if (outcome.variations.empty()) return;
  html +=
      "<details><summary>Sensitivity to what the paper does not give</summary>\n"
      "<p class=\"hint\">The same predicates with other tissue, tuning or discretisation, in the "
      "model and in the eye alike. ✓ holds, ≠ differs.</p>\n"
      "<div class=\"scroll\"><table class=\"sens\"><thead><tr><th>claim</th><th>as above</th>";
  for (const VariedStudy& row : outcome.variations) {
    fmt::format_to(Out(html), "<th>{}</th>", escape_html(row.variation.title));
  }
  html += "</tr></thead>\n";
  for (std::size_t i = 0; i < outcome.claims.size(); ++i) {
    if (outcome.claims[i].verdict == Verdict3::kCannotJudge) continue;
    fmt::format_to(Out(html), "<tr><td>{}</td><td>{}</td>",
                   escape_html(outcome.claims[i].claim.text), symbol(outcome.claims[i].verdict));
    for (const VariedStudy& row : outcome.variations) {
      fmt::format_to(Out(html), "<td>{}</td>", symbol(row.verdicts[i]));
    }
    html += "</tr>\n";
  }
  html += "</table></div></details>\n";
}

void study_section(std::string& html, const StudyOutcome& outcome,
                   const std::vector<StudyDrawing>& drawings) {
  const Study& study = outcome.study;
  fmt::format_to(Out(html), "<section id=\"{}\"><h2>{}</h2>\n<p class=\"run\">{} · {} {}</p>\n",
                 study.id, escape_html(study.title), escape_html(study.paper), outcome.seeds,
                 study.kind == StudyKind::kComputationTimes ? "treatments timed" : "noise seeds");
  if (!study.note.empty()) fmt::format_to(Out(html), "<p>{}</p>\n", escape_html(study.note));
  fmt::format_to(Out(html), "<div class=\"columns count-{}\" style=\"margin-top:14px\">\n",
                 drawings.size() > 1 ? 2 : 1);
  for (const StudyDrawing& drawing : drawings) {
    fmt::format_to(Out(html),
                   "<div class=\"column\"{}><h3>{}</h3>\n<figure>{}</figure><p class=\"hint\">"
                   "Files beside this page: <code>{}</code>, <code>{}</code>{}</p></div>\n",
                   drawings.size() > 1 ? "" : " style=\"max-width:640px\"",
                   escape_html(drawing.title), drawing.svg, drawing.svg_file, drawing.csv_file,
                   study.kind == StudyKind::kClosedLoop ? " (all seeds; the first is drawn)" : "");
  }
  html += "</div>\n";
  if (study.kind == StudyKind::kComputationTimes) times_table(html, outcome);
  claims_table(html, outcome);
  sensitivity_table(html, outcome);
  fmt::format_to(Out(html),
                 "<details><summary>Configuration: <code>studies/{}.toml</code></summary>\n<pre "
                 "class=\"config\" tabindex=\"0\"><code>{}</code></pre></details>\n</section>\n",
                 study.id, escape_html(read_file(study.file.string(), 1'000'000)));
}

void summary(std::string& html, const std::vector<StudyOutcome>& outcomes) {
  std::size_t count[3] = {};
  std::size_t unexpected = 0;
  for (const StudyOutcome& outcome : outcomes) {
    for (const JudgedClaim& claim : outcome.claims) {
      ++count[static_cast<int>(claim.verdict)];
      unexpected += claim.as_expected() ? 0 : 1;
    }
  }
  html += "<dl class=\"tiles\">\n";
  const auto tile = [&html](std::string_view name, std::size_t value, std::string_view note) {
    html += page_tile(name, std::to_string(value), note);
  };
  tile("Claims", count[0] + count[1] + count[2], "of the paper's text");
  tile("✓ hold", count[0], "on the simulated eye");
  tile("≠ differ", count[1], "how and why stands beside each");
  tile("? cannot be judged", count[2],
       unexpected == 0 ? "no verdict has changed" : "SOME VERDICTS HAVE CHANGED");
  html += "</dl>\n<section><h2>All claims</h2>\n";
  for (const StudyOutcome& outcome : outcomes) {
    fmt::format_to(Out(html), "<p style=\"margin-top:10px\"><a href=\"#{}\">{}</a></p>\n<ul>\n",
                   outcome.study.id, escape_html(outcome.study.title));
    for (const JudgedClaim& claim : outcome.claims) {
      fmt::format_to(Out(html), "<li>{} <strong>{}</strong>: {}</li>\n", symbol(claim.verdict),
                     name_of(claim.verdict), escape_html(claim.claim.text));
    }
    html += "</ul>\n";
  }
  html += "</section>\n";
}

}  // namespace

std::string reproduce_page(const std::vector<StudyOutcome>& outcomes,
                           const std::vector<std::vector<StudyDrawing>>& drawings, bool quick) {
  std::string html = page_begin(
      "The paper's results on the simulated eye",
      quick ? "reproduction, shortened" : "reproduction",
      "Model predictive control for retinal laser treatment at 1 kHz (Schaller, Kleyman, "
      "Mordmüller, Schmidt, Wilson, Brinkmann, Müller, Worthmann)",
      "Layer thicknesses, spot radius and the filter's tuning are not in the paper: its exact "
      "curves cannot be claimed, only its model, its method and what it says. Where the paper "
      "treats porcine eyes, this treats simulated ones.",
      kCss);
  summary(html, outcomes);
  for (std::size_t i = 0; i < outcomes.size(); ++i) study_section(html, outcomes[i], drawings[i]);
  return html + page_end();
}

}  // namespace photocoag
