// index.html of `reproduce`.
#include <fmt/format.h>

#include <set>

#include "photocoag/core/files.hpp"
#include "photocoag/page/page.hpp"
#include "photocoag/study/reproduce.hpp"
#include "photocoag/study/timing.hpp"

namespace photocoag {
namespace {

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
.claims .ours{border:1px solid var(--line);border-radius:3px;padding:0 5px;font-size:.8125rem;color:var(--quiet)}
.claims summary{font-weight:400;color:var(--quiet);font-size:.8125rem}
.claims details code{font-size:.75rem}
.sens td,.sens th{border-top:1px solid var(--line);padding:4px 10px 4px 0;text-align:center;font-weight:400;font-size:.875rem}
.sens tr>:first-child{text-align:left;min-width:16rem}
.single{max-width:640px}
.columns{margin-top:14px}
@media screen and (max-width:640px){.claims .pred{width:auto}}
)css";

std::string_view symbol(ClaimVerdict verdict) {
  if (verdict == ClaimVerdict::kHolds) return "✓";
  if (verdict == ClaimVerdict::kUndecided) return "~";
  return verdict == ClaimVerdict::kDiffers ? "≠" : "?";
}

// A table whose cells are not text alone.
Html wide_table(std::string_view selector, std::string_view name,
                const std::vector<std::string>& head, const Html& rows) {
  Html cells;
  for (const std::string& cell : head) cells += element("th", cell, {{"scope", "col"}});
  return scroll(element(selector, {element("thead", element("tr", cells)), element("tbody", rows)}),
                name);
}

// Why the verdict is what it is; empty: the numbers say it.
std::string reason(const JudgedClaim& judged) {
  const Claim& claim = judged.claim;
  std::string why;
  if (judged.verdict == ClaimVerdict::kCannotJudge) why = claim.cannot_judge;
  if (judged.verdict == ClaimVerdict::kDiffers)
    why = claim.differs.empty() ? "The data contradict the claim; the study's file gives no reason."
                                : claim.differs;
  if (judged.verdict == ClaimVerdict::kUndecided)
    why = "The interval covers the threshold: more seeds may decide.";
  if (!judged.as_expected())
    why += fmt::format(" The study's file expects “{}”: something has changed.", claim.expected);
  return why;
}

Html term_list(const std::vector<TermValue>& terms) {
  Html list;
  std::set<std::string> shown;
  for (const TermValue& term : terms) {
    if (!shown.insert(term.term.text()).second) continue;
    std::string value = number_text(term.value, unit_of(term.term.measure));
    if (term.low != term.high) value += fmt::format(" ({:.3g} to {:.3g})", term.low, term.high);
    list += element("li", {element("code", term.term.text()), " = ", value});
  }
  return element("ul", list);
}

Html measured(const JudgedClaim& judged) {
  if (judged.verdict == ClaimVerdict::kCannotJudge) return {};
  Html all = term_list(judged.terms) + element("details", {element("summary", "holds if"),
                                                           element("code", judged.claim.holds_if)});
  if (judged.in_truth) {
    all += element("p.why", {"In truth, which an experiment does not show: ",
                             element("strong", name_of(*judged.in_truth))}) +
           term_list(judged.truth_terms) +
           element("details",
                   {element("summary", "holds if"), element("code", judged.claim.in_truth)});
  }
  return all;
}

Html claims_table(const StudyOutcome& outcome) {
  Html rows;
  for (const JudgedClaim& judged : outcome.claims) {
    Html text(judged.claim.text);
    if (judged.claim.ours) text = element("span.ours", "ours, not the paper's") + Html(" ") + text;
    if (const std::string why = reason(judged); !why.empty()) text += element("p.why", why);
    rows += element(
        "tr",
        {element("td.mark", {element("span", symbol(judged.verdict)), name_of(judged.verdict)}),
         element("td", text), element("td.pred", measured(judged))});
  }
  return wide_table("table.claims", "Claims",
                    {"verdict", "what the paper says", "measured, over the seeds (95 % interval)"},
                    rows);
}

Html times_table(const StudyOutcome& outcome) {
  Table times{.head = {"N", "paper, average", "paper, maximum", "solver here", "average", "maximum",
                       "first solve", "worst later solve"},
              .rows = {}};
  for (const RunResult& run : outcome.results) {
    const PaperTime paper = paper_time(run.config.control.horizon);
    const auto us = [&run](const char* measure, const char* statistic) {
      return fmt::format("{:.2f} µs", statistic_of(statistic, run.measures.at(measure)));
    };
    times.rows.push_back({fmt::format("{}", run.config.control.horizon),
                          fmt::format("{:.0f} µs", paper.average_ms * 1e3),
                          fmt::format("{:.0f} µs", paper.maximum_ms * 1e3),
                          run.id.substr(0, run.id.find("_n")), us("solve_mean_us", "mean"),
                          us("solve_max_us", "max"), us("solve_first_us", "median"),
                          us("solve_warm_worst_us", "median")});
  }
  return table(times, "Computation times") +
         element("p.hint",
                 "Average and maximum over all cycles and treatments, the machine's interruptions "
                 "included. First and worst later solve: the least of five repetitions of the same "
                 "solve, median of the treatments. The paper's times are from another machine.");
}

Html sensitivity_table(const StudyOutcome& outcome) {
  if (outcome.variations.empty()) return {};
  std::vector<std::string> head = {"claim", "as above"};
  for (const VariedStudy& row : outcome.variations) head.push_back(row.variation.title);
  Html rows;
  for (std::size_t i = 0; i < outcome.claims.size(); ++i) {
    if (outcome.claims[i].verdict == ClaimVerdict::kCannotJudge) continue;
    Html cells = element("td", outcome.claims[i].claim.text) +
                 element("td", symbol(outcome.claims[i].verdict));
    for (const VariedStudy& row : outcome.variations)
      cells += element("td", symbol(row.verdicts[i]));
    rows += element("tr", cells);
  }
  return element("details",
                 {element("summary", "Sensitivity to what the paper does not give"),
                  element("p.hint",
                          "The same predicates with other tissue, tuning or discretisation, in the "
                          "model and in the eye alike. ✓ holds, ≠ differs, ~ undecided with so few "
                          "seeds."),
                  wide_table("table.sens", "Sensitivity", head, rows)});
}

Html study_section(const StudyOutcome& outcome, const std::vector<StudyDrawing>& drawings) {
  const Study& study = outcome.study;
  const bool loops = study.kind == StudyKind::kClosedLoop;
  Html content = element("h2", study.title) +
                 element("p.run", fmt::format("{} · {} {}", study.paper, outcome.seeds,
                                              loops ? "noise seeds" : "treatments timed"));
  if (!study.note.empty()) content += element("p", study.note);
  Html columns;
  for (const StudyDrawing& drawing : drawings)
    columns +=
        element("div.column",
                {element("h3", drawing.title), figure_element(drawing.figure),
                 element("p.hint", {"Files beside this page: ", element("code", drawing.svg_file),
                                    ", ", element("code", drawing.csv_file),
                                    loops ? " (all seeds; the first is drawn)" : ""})});
  content += element(drawings.size() > 1 ? "div.columns.count-2" : "div.columns.single", columns);
  if (!loops) content += times_table(outcome);
  content += claims_table(outcome) + sensitivity_table(outcome) +
             unfold(Html("Configuration: ") + element("code", "studies/" + study.id + ".toml"),
                    read_file(study.file.string(), 1'000'000));
  return element("section", content, {{"id", study.id}});
}

Html summary(const std::vector<StudyOutcome>& outcomes) {
  std::size_t count[kClaimVerdicts] = {};
  std::size_t ours = 0;
  std::size_t unexpected = 0;
  Html list;
  for (const StudyOutcome& outcome : outcomes) {
    Html claims;
    for (const JudgedClaim& claim : outcome.claims) {
      ++count[static_cast<int>(claim.verdict)];
      unexpected += claim.as_expected() ? 0 : 1;
      ours += claim.claim.ours ? 1 : 0;
      claims += element("li", {symbol(claim.verdict), " ",
                               element("strong", name_of(claim.verdict)), ": " + claim.claim.text});
    }
    list +=
        element("p.hint", element("a", outcome.study.title, {{"href", "#" + outcome.study.id}})) +
        element("ul", claims);
  }
  const auto tile = [](const char* name, std::size_t value, const char* note) {
    return Tile{name, std::to_string(value), note};
  };
  const std::string whose = fmt::format("{} of them ours, not the paper's", ours);
  return tiles({tile("Claims", count[0] + count[1] + count[2] + count[3], whose.c_str()),
                tile("✓ hold", count[0], "on the simulated eye"),
                tile("≠ differ", count[1], "how and why stands beside each"),
                tile("~ undecided", count[2], "other seeds, another verdict"),
                tile("? cannot be judged", count[3],
                     unexpected == 0 ? "no verdict has changed" : "SOME VERDICTS HAVE CHANGED")}) +
         section("All claims", list);
}

}  // namespace

std::string reproduce_page(const std::vector<StudyOutcome>& outcomes,
                           const std::vector<std::vector<StudyDrawing>>& drawings, bool quick) {
  const PageHead head{
      .title = "The paper's results on the simulated eye",
      .kicker = quick ? "reproduction, shortened" : "reproduction",
      .line =
          "Model predictive control for retinal laser treatment at 1 kHz (Schaller, Kleyman, "
          "Mordmüller, Schmidt, Wilson, Brinkmann, Müller, Worthmann)",
      .notice =
          "Layer thicknesses, spot radius and the filter's tuning are not in the paper: its "
          "exact curves cannot be claimed, only its model, its method and what it says. Where "
          "the paper treats porcine eyes, this treats simulated ones.",
      .css = kCss};
  Html body = summary(outcomes);
  for (std::size_t i = 0; i < outcomes.size(); ++i) body += study_section(outcomes[i], drawings[i]);
  return page(head, body);
}

}  // namespace photocoag
