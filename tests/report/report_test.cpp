// The report of a run: complete, self-contained, and its numbers are the log's.
#include "photocoag/report/report.hpp"

#include <gtest/gtest.h>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/page/page.hpp"
#include "run_folder.hpp"

namespace photocoag {
namespace {

using testing::count_of;
using testing::RunFolder;
using testing::xml_problem;

std::string page_of(const RunFolder& run) {
  run.write();
  write_report(run.path);
  return run.get("report.html");
}

void expect_on(const std::string& page, const std::string& text) {
  EXPECT_NE(page.find(text), std::string::npos) << "missing: " << text;
}
void expect_not_on(const std::string& page, const std::string& text) {
  EXPECT_EQ(page.find(text), std::string::npos) << "found: " << text;
}

std::string failure(const RunFolder& run) {
  try {
    write_report(run.path);
  } catch (const Error& error) {
    EXPECT_FALSE(std::filesystem::exists(run.path / "report.html"));
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Report, IsSelfContained) {
  const std::string page = page_of(RunFolder());
  for (const std::string part : {"http://", "https://", "url(", "@import", "src=", "<link",
                                 "<iframe", "javascript:", "onload="})
    expect_not_on(page, part);
  expect_on(page, "<html lang=\"en\">");
  expect_on(page, "name=\"viewport\"");
  expect_on(page, "prefers-color-scheme:dark");
  expect_on(page, "@media print");
  EXPECT_EQ(count_of(page, kResearchNotice.data()), 2U);
  expect_not_on(page, " id=");               // nothing that could clash
  EXPECT_EQ(count_of(page, "<script"), 1U);  // its own, named in its policy (Page.ItsPolicy…)
  expect_on(page, std::string(page_script()));
}

TEST(Report, DrawingsAreWellFormedAndDescribed) {
  const std::string page = page_of(RunFolder());
  std::size_t drawings = 0;
  for (std::size_t at = page.find("<svg"); at != std::string::npos;
       at = page.find("<svg", at + 1)) {
    const std::string svg = page.substr(at, page.find("</svg>", at) + 6 - at);
    EXPECT_EQ(xml_problem(svg), "");
    expect_on(svg, "role=\"img\" aria-label=\"");
    ++drawings;
  }
  EXPECT_EQ(drawings, 20U);  // five panels, whole run and zoom, wide and narrow
}

TEST(Report, NoZoomForAShortRun) {
  RunFolder run;
  run.cycles = 40;
  const std::string page = page_of(run);
  EXPECT_EQ(count_of(page, "<svg"), 10U);
  expect_not_on(page, "First 20 ms");
}

TEST(Report, NumbersAreTheSummarys) {
  const RunFolder run;
  const std::string page = page_of(run);
  const std::string s = "\u00a0";
  expect_on(page, "Held 30" + s + "K: peak 30.2" + s + "K, limit 32" + s + "K not exceeded, 95" +
                      s + "% after 6" + s + "ms.");
  expect_on(page, "30.25" + s + "K");     // highest peak
  expect_on(page, "52.25" + s + "°C");    // + 22 °C
  expect_on(page, "30.00" + s + "K");     // highest estimate
  expect_on(page, "0.249" + s + "K");     // RMS
  expect_on(page, "−0.55" + s + "%");     // error of alpha, -0.545 %
  expect_on(page, "0.001725" + s + "J");  // (3 * 0.1 + 57 * 0.025) W * 1 ms = 1.725 mJ
  expect_on(page, "100.00" + s + "mW");
  expect_on(page, ">17</td>");  // overruns
  expect_on(page, ">80641</td>");
  expect_on(page, ">123456789</td>");
  expect_on(page, ">59</td>");  // cycles with status solved
  expect_on(page, "iteration_limit");
  expect_on(page, "0.1.0-test");
  expect_on(page, std::string(61, '0') + "abc");
  expect_on(page, "./photocoag simulate --config " + run.path.string() + "/config.toml</code>");
}

TEST(Report, AChanceControllerShowsItsBandAndSaysWhyItHoldsThePeakThere) {
  RunFolder run;
  run.height = 28.0;
  const std::string before = page_of(run);
  expect_not_on(before, "allowed by what is known");
  expect_not_on(before, ">95 %<");
  run.peak_sigma_K = 0.8;
  run.timing =
      ", \"chance\": {\"limit_probability\": 0.001, \"kept_deviations\": 3.66}"
      ", \"prior_check\": {\"doubtful\": true}";
  const std::string page = page_of(run);
  const std::string s = "\u00a0";
  expect_on(page, "allowed by what is known");
  expect_on(page, "95 %");
  // 32 K exp(-3.66 * 0.8 / (30 / 30.25 * 28)) = 28.80 K; 0.8 K are 2.9 %.
  expect_on(page, "99.9" + s + "% probability");
  expect_on(page, "standard deviation of 2.9" + s + "%");
  expect_on(page, "which allows 28.8" + s + "K.");
  expect_on(page, "This eye does not fit the prior.");
}

TEST(Report, TimingIsGenericAndOptional) {
  RunFolder run;
  expect_not_on(page_of(run), "<h2>Timing</h2>");
  run.timing =
      ", \"timing\": {\"cycle_us\": {\"median\": 3.125, \"p99\": 41}, \"wake_late_us\": "
      "{\"max\": 212.4}, \"cores\": 2}";
  const std::string page = page_of(run);
  expect_on(page, "<h2>Timing</h2>");
  expect_on(page, "cycle in µs</th><td>3.12</td><td>41</td><td>–</td>");
  expect_on(page, "wake late in µs");
}

TEST(Report, ARunOnADeviceSaysWhatTheDeviceDid) {
  RunFolder run;
  run.timing =
      ", \"device\": {\"name\": \"eye\", \"late_commands\": 131, "
      "\"pulse_peak_true_max_K\": 31.24}";
  const std::string page = page_of(run);
  expect_on(page, "Commands late");
  expect_on(page, ">131</td>");
  expect_on(page, "31.24\u00a0K");
  expect_on(page, "./photocoag replay " + run.path.string() + "</code>");
  expect_not_on(page, "photocoag simulate --config");
  expect_not_on(page_of(RunFolder()), "Commands late");
}

TEST(Report, HistogramsAreDrawnBesideTheTiming) {
  RunFolder run;
  run.timing =
      ", \"timing\": {\"wake_us\": {\"median\": 12}, \"write_us\": {\"median\": 0}}, "
      "\"histograms\": {\"wake_us\": {\"bins\": [[11, 40], [12, 19], [71, 1]], \"below_0\": 0, "
      "\"overflow\": 0, \"without\": 0}, \"write_us\": {\"bins\": [], \"below_0\": 0, "
      "\"overflow\": 0, \"without\": 60}}";
  const std::string page = page_of(run);
  EXPECT_EQ(count_of(page, "<svg"), 20U + 2U);  // nothing to draw for write
  EXPECT_EQ(count_of(page, ">Wake: cycles per 1 µs</text>"), 2U);
  expect_on(page, "most (40) from 11 to 12 µs.");
  const std::size_t drawings = page.find("<div class=\"columns count-1 histograms\">");
  ASSERT_NE(drawings, std::string::npos);
  EXPECT_EQ(xml_problem(page.substr(drawings, page.find("</section>", drawings) - drawings)), "");
  run.cycles = 0;  // no cycle: the histograms alone
  EXPECT_EQ(count_of(page_of(run), "<svg"), 2U);
}

TEST(Report, MalformedHistogramsAreNamed) {
  RunFolder run;
  for (const std::string bins : {"[[1, 2], [1, 3]]", "[[-1, 2]]", "[[1, 2.5]]", "[[1]]", "7",
                                 "[[9223372036854775807, 1]]"}) {
    run.timing = ", \"histograms\": {\"wake_us\": {\"bins\": " + bins + "}}";
    run.write();
    expect_on(failure(run), "summary.json: histograms.wake_us: bins: found ");
  }
}

TEST(Report, SaysWhenTheLimitWasExceeded) {
  RunFolder run;
  run.violation_at = 33;
  const std::string page = page_of(run);
  expect_on(page, "exceeded in 1 cycle: peak 40.0");
  expect_on(page, "class=\"badge alarm\"");
  expect_on(page, ">over limit</text>");
}

TEST(Report, SaysWhyItWasStopped) {
  RunFolder run;
  run.cycles = 25;
  run.stopped_for = "\"sample <lost>\"";
  const std::string page = page_of(run);
  expect_on(page, "Stopped after 25 cycles (25\u00a0ms): sample &lt;lost&gt;. Peak ");
  expect_on(page, "class=\"badge alarm\"");
}

TEST(Report, NoCycleAtAll) {
  RunFolder run;
  run.cycles = 0;
  run.truth = false;
  run.stopped_for = "\"laser not ready\"";
  const std::string page = page_of(run);
  expect_on(page, "Stopped after 0 cycles");
  expect_on(page, "No cycle was run.");
}

TEST(Report, LeavesTheTruthOutIfTheEyeIsNotSimulated) {
  RunFolder run;
  expect_on(page_of(run), ">true</text>");
  run.truth = false;
  const std::string page = page_of(run);
  expect_not_on(page, ">true</text>");
  expect_not_on(page, ">true 1.1</text>");
  expect_on(page, ">estimate</text>");
  expect_on(page, "by the estimate: estimated peak 30.0");
  expect_on(page, "Highest estimated peak");
}

TEST(Report, EscapesWhatItIsGiven) {
  RunFolder run;
  run.config_comment = "# <script>alert('x')</script> & \"more\"";
  const std::string page = page_of(run);
  EXPECT_EQ(count_of(page, "<script"), 1U);
  expect_on(page, "# &lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt; &amp; &quot;more&quot;");
}

TEST(Report, SameFolderSameBytes) {
  const RunFolder run;
  const std::string first = page_of(run);
  EXPECT_EQ(first, page_of(run));
  EXPECT_FALSE(std::filesystem::exists(run.path / "report.html.part"));
}

TEST(Report, PointsOutWhenLogAndSummaryDisagree) {
  RunFolder run;
  expect_not_on(page_of(run), "disagree");
  std::string summary = run.get("summary.json");
  summary.replace(summary.find("\"cycles\": 60"), 12, "\"cycles\": 61");
  run.put("summary.json", summary);
  write_report(run.path);
  expect_on(run.get("report.html"), "cycles: run.csv gives 60, summary.json says 61.");
}

TEST(Report, MalformedInputNamesFileLineAndColumn) {
  const RunFolder run;
  const auto broken = [&run](const char* file, const std::string& from, const std::string& to) {
    run.write();
    std::string text = run.get(file);
    text.replace(text.find(from), from.size(), to);
    run.put(file, text);
    return failure(run);
  };
  std::string message = broken("run.csv", "\n4,0.005,", "\n4,0.0o5,");
  expect_on(message, "run.csv:6: column time_s: found \"0.0o5\"; accepted: a number");
  message = broken("run.csv", "\n4,0.005,", "\n4,0.001,");
  expect_on(message, "run.csv:6: column time_s: found 0.001; accepted: above 0.004");
  message = broken("run.csv", "\n4,0.005,0.025,", "\n4,0.005,inf,");
  expect_on(message, "run.csv:6: column power_W: found inf; accepted: a finite number");
  message = broken("run.csv", "\n4,0.005,", "\n4,");
  expect_on(message, "run.csv:6: the row does not match the header; found 13 columns");
  message = broken("run.csv", "power_W,", "power_mW,");
  expect_on(message, "run.csv:1: column power_W: found no such column");
  message = broken("summary.json", "\"limit_active_cycles\":", "\"limit_active_cycles\"");
  expect_on(message, "summary.json:2:46: not valid JSON");
  message = broken("summary.json", "\"overruns\"", "\"overrun\"");
  expect_on(message, "summary.json: overruns: the key is missing");
  message = broken("summary.json", "\"limit_K\": 32.0", "\"limit_K\": \"32\"");
  expect_on(message, "summary.json: limit_K: found \"32\"; accepted: a number or null");
  message = broken("config.toml", "peak_max_K = 32.0", "peak_max_K = = 32.0");
  expect_on(message, "config.toml:4:14: ");
  message = broken("config.toml", "ambient_C", "ambient");
  expect_on(message, "config.toml: tissue.ambient_C: ");
  run.put("run.csv", "");
  run.put("config.toml",
          "[control]\npeak_reference_K = 30\npower_max_W = 0.1\n[tissue]\n"
          "ambient_C = 22\n");
  expect_on(failure(run), "run.csv:1: the file is empty");
  std::filesystem::remove(run.path / "run.csv");
  expect_on(failure(run), "run.csv: cannot be read");
}

}  // namespace
}  // namespace photocoag
