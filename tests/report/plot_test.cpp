// Figures: properties of the drawing, not its look.
#include "photocoag/report/plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "run_folder.hpp"

namespace photocoag {
namespace {

using testing::count_of;
using testing::xml_problem;

Series wave(std::size_t count) {
  Series series{.legend = "wave"};
  for (std::size_t k = 0; k < count; ++k) {
    series.x.push_back(static_cast<double>(k));
    series.y.push_back(std::sin(0.01 * static_cast<double>(k)));
  }
  return series;
}

Figure example() {
  Figure figure{.description = "An <example> & more", .x_label = "time in ms", .x_max = 100.0};
  Series line = wave(101), dots = wave(101), steps = wave(101);
  line.dash = Dash::kDashed;
  dots.mark = Mark::kPoints;
  dots.ink = Ink::kMuted;
  steps.mark = Mark::kSteps;
  steps.ink = Ink::kSeries3;
  Band band{.legend = "band", .x = line.x, .low = line.y, .high = line.y};
  for (double& high : band.high) high += 0.1;
  figure.panels = {Panel{.title = "First in K", .bands = {band}, .series = {line, dots}},
                   Panel{.title = "Second in mW",
                         .series = {steps},
                         .levels = {{.label = "limit <1>", .y = 1.0, .ink = Ink::kLimit}}}};
  return figure;
}

std::string render(const Figure& figure, SvgKind kind = SvgKind::kInline) {
  return render_figures(std::span(&figure, 1), kind).at(0);
}

template <class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Decimate, KeepsASpikeOfOneSample) {
  for (const std::size_t at : {1U, 4321U, 7777U, 9998U}) {
    Series series = wave(10000);
    series.y[at] = 50.0;
    const Series few = decimate(series, 2000);
    EXPECT_LE(few.x.size(), 2002U);
    const auto found = std::find(few.y.begin(), few.y.end(), 50.0);
    ASSERT_NE(found, few.y.end()) << "spike at " << at;
    EXPECT_EQ(few.x[static_cast<std::size_t>(found - few.y.begin())], static_cast<double>(at));
  }
}

TEST(Decimate, KeepsEndsOrderGapsAndShortSeries) {
  Series series = wave(10000);
  series.y[5000] = NAN;
  const Series few = decimate(series, 500);
  EXPECT_EQ(few.x.front(), 0.0);
  EXPECT_EQ(few.x.back(), 9999.0);
  EXPECT_TRUE(std::is_sorted(few.x.begin(), few.x.end()));
  EXPECT_EQ(std::count_if(few.y.begin(), few.y.end(), [](double y) { return std::isnan(y); }), 1);
  EXPECT_EQ(decimate(wave(2000), 2000).x.size(), 2000U);
}

TEST(Decimate, BandContainsTheWholeBand) {
  Band band{.x = wave(10000).x, .low = wave(10000).y, .high = wave(10000).y};
  band.low[1234] = -9.0;
  band.high[8765] = 9.0;
  const Band few = decimate(band, 1000);
  EXPECT_EQ(few.x.size(), 1000U);
  EXPECT_EQ(few.x.front(), 0.0);
  EXPECT_EQ(few.x.back(), 9999.0);
  EXPECT_EQ(*std::min_element(few.low.begin(), few.low.end()), -9.0);
  EXPECT_EQ(*std::max_element(few.high.begin(), few.high.end()), 9.0);
}

TEST(Plot, SpikeReachesTheTopOfTheDrawing) {
  Figure figure{.x_label = "x", .x_max = 9999.0, .max_points = 200};
  figure.panels = {Panel{.title = "y", .series = {wave(10000)}}};
  figure.panels[0].series[0].y[6543] = 10.0;
  const std::string with = render(figure);
  figure.panels[0].y_max = 10.6;  // the same range, the spike taken away
  figure.panels[0].y_min = -1.66;
  figure.panels[0].series[0].y[6543] = 0.0;
  EXPECT_NE(with, render(figure));
  EXPECT_LT(count_of(with, "L"), 400U);
}

TEST(Plot, IsWellFormedEscapedAndWithoutPlaceholders) {
  for (const SvgKind kind : {SvgKind::kInline, SvgKind::kStandAlone}) {
    const std::string svg = render(example(), kind);
    EXPECT_EQ(xml_problem(svg), "");
    for (const std::string part :
         {"rgb(", "#fa01", "#FA01", "id=", "xlink", "<script", "gnuplot", "GNUPLOT", "url("})
      EXPECT_EQ(svg.find(part), std::string::npos) << part;
    EXPECT_NE(svg.find("aria-label=\"An &lt;example&gt; &amp; more\""), std::string::npos);
    EXPECT_NE(svg.find(">limit &lt;1&gt;</text>"), std::string::npos);
    EXPECT_NE(svg.find(">Second in mW</text>"), std::string::npos);
    EXPECT_NE(svg.find("class=\"pc-line-limit\""), std::string::npos);
    EXPECT_NE(svg.find("class=\"pc-area-series-2\""), std::string::npos);
    EXPECT_NE(svg.find("stroke-dasharray=\"7"), std::string::npos);
    EXPECT_EQ(svg.find("<style>") != std::string::npos, kind == SvgKind::kStandAlone);
  }
}

TEST(Plot, StyleHasEveryClassOfTheDrawing) {
  for (const SvgKind kind : {SvgKind::kInline, SvgKind::kStandAlone}) {
    const std::string svg = render(example(), SvgKind::kInline);
    const std::string css = plot_css(kind);
    EXPECT_NE(css.find("prefers-color-scheme:dark"), std::string::npos);
    for (std::size_t at = svg.find("class=\"pc-"); at != std::string::npos;
         at = svg.find("class=\"pc-", at + 1)) {
      const std::size_t begin = at + 7;
      const std::string name = svg.substr(begin, svg.find_first_of("\" ", begin) - begin);
      EXPECT_NE(css.find("." + name), std::string::npos) << name;
    }
  }
  EXPECT_EQ(plot_css(SvgKind::kStandAlone).find("var("), std::string::npos);
}

TEST(Plot, SameDataSameBytes) { EXPECT_EQ(render(example()), render(example())); }

TEST(Plot, OneRunDrawsManyFiguresInOrder) {
  std::vector<Figure> figures(3, example());
  figures[1].description = "the second";
  const auto drawn = render_figures(figures, SvgKind::kInline);
  ASSERT_EQ(drawn.size(), 3U);
  EXPECT_EQ(drawn[0], drawn[2]);
  EXPECT_NE(drawn[1].find("the second"), std::string::npos);
}

TEST(Plot, StepsHoldUntilTheEndOfTheirInterval) {
  // 5 until x = 1, then 9 until x = 2: the rise is at x = 1, before the second value's x.
  Figure figure{.x_label = "x", .x_max = 2.0, .width = 258.0, .panel_height = 200.0};
  figure.panels = {Panel{.title = "u",
                         .series = {{.x = {0, 1, 2}, .y = {5, 5, 9}, .mark = Mark::kSteps}},
                         .y_min = 0.0,
                         .y_max = 10.0}};
  const std::string svg = render(figure);
  // Plot area from x = 46 to 246: x = 1 is at 146, and the curve rises there.
  const std::size_t at = svg.find("class=\"pc-line-series-1\"");
  ASSERT_NE(at, std::string::npos);
  const std::string path = svg.substr(at, svg.find("/>", at) - at);
  EXPECT_EQ(count_of(path, "L146 ") + count_of(path, "L145.99 ") + count_of(path, "L146.01 "), 2U)
      << path;
}

TEST(Plot, EmptySeriesAndGapsAreFine) {
  Figure figure{.x_label = "x", .x_max = 3.0};
  figure.panels = {Panel{.title = "a", .series = {{.legend = "none"}}},
                   Panel{.title = "b", .series = {{.x = {0, 1, 2, 3}, .y = {1, NAN, 2, 3}}}}};
  EXPECT_EQ(xml_problem(render(figure)), "");
}

TEST(Plot, RefusesInvalidFigures) {
  Figure figure = example();
  figure.x_max = figure.x_min;
  EXPECT_NE(message_of([&] { render(figure); }).find("x_min below x_max"), std::string::npos);
  figure = example();
  figure.panels[0].series[0].y.pop_back();
  EXPECT_NE(message_of([&] { render(figure); }).find("First in K, wave"), std::string::npos);
  figure = example();
  figure.panels[0].series[0].x[5] = -3.0;
  EXPECT_NE(message_of([&] { render(figure); }).find("ascending"), std::string::npos);
}

// The end points of the first curve of a drawing, in px: {y of the first, y of the last}.
std::pair<double, double> ends_of_curve(const std::string& svg) {
  const std::size_t path = svg.find("<path class=\"pc-line-series-1\"");
  const std::size_t data = svg.find(" d=\"M", path) + 5;
  const std::string curve = svg.substr(data, svg.find('"', data) - data);
  return {std::stod(curve.substr(curve.find(' '))), std::stod(curve.substr(curve.rfind(' ')))};
}

TEST(Plot, OnALogarithmicAxisEveryPowerOfTenIsAsHigh) {
  const auto height = [](double from, double to) {
    Figure figure{.x_max = 1.0};
    figure.panels = {Panel{.title = "counts",
                           .series = {{.x = {0.0, 1.0}, .y = {from, to}}},
                           .y_min = 0.5,
                           .y_max = 1e4,
                           .y_log = true}};
    const auto [first, last] = ends_of_curve(render(figure));
    return first - last;
  };
  const double decade = height(1.0, 10.0);
  EXPECT_GT(decade, 20.0);
  // gnuplot writes px with two digits.
  EXPECT_NEAR(height(100.0, 1000.0), decade, 0.03);
  EXPECT_NEAR(height(1.0, 1000.0), 3.0 * decade, 0.03);
  // A count of 0 lies on the axis, half a count up.
  EXPECT_NEAR(height(0.0, 1.0), decade * std::log10(2.0), 0.03);
}

TEST(Plot, ALevelLiesWhereTheLogarithmPutsIt) {
  Figure figure{.x_max = 1.0};
  figure.panels = {Panel{.series = {{.x = {0.0, 1.0}, .y = {100.0, 100.0}}},
                         .levels = {{.label = "hundred", .y = 100.0}},
                         .y_min = 1.0,
                         .y_max = 1e4,
                         .y_log = true}};
  const std::string svg = render(figure);
  const std::size_t name = svg.find("pc-text-level");
  const double base_line = std::stod(svg.substr(svg.find(" y=\"", name) + 4));
  EXPECT_NEAR(base_line + 4.0, ends_of_curve(svg).first, 0.03);  // names stand 4 px above
  figure.panels[0].levels[0].y = 0.0;
  EXPECT_NE(message_of([&] { render(figure); }).find("a finite level above 0"), std::string::npos);
  figure.panels[0].levels.clear();
  figure.panels[0].y_min = 0.0;
  EXPECT_NE(message_of([&] { render(figure); }).find("y is logarithmic"), std::string::npos);
}

TEST(Plot, WithoutARangeALogarithmicAxisHoldsTheValuesAboveZero) {
  Figure figure{.x_max = 3.0};
  figure.panels = {
      Panel{.series = {{.x = {0.0, 1.0, 2.0, 3.0}, .y = {0.0, 30.0, NAN, 700.0}}}, .y_log = true}};
  const std::string svg = render(figure);
  for (const char* tick : {">10</text>", ">100</text>", ">1000</text>"})
    EXPECT_NE(svg.find(tick), std::string::npos) << tick;
  figure.panels[0].series[0].y[1] = 30'000.0;
  EXPECT_NE(render(figure).find(">100k</text>"), std::string::npos);
  figure.panels[0].series.clear();
  EXPECT_EQ(xml_problem(render(figure)), "");
}

TEST(Plot, MissingGnuplotNamesThePackage) {
  const Figure figure = example();
  const auto draw = [&](const std::string& program) {
    return message_of(
        [&] { render_figures(std::span(&figure, 1), SvgKind::kInline, {.gnuplot = program}); });
  };
  EXPECT_NE(draw("no-such-program-of-that-name").find("gnuplot-nox"), std::string::npos);
  EXPECT_NE(draw("/nowhere/gnuplot").find("gnuplot-nox"), std::string::npos);
  EXPECT_NE(draw("false").find("ended with code 1"), std::string::npos);
  EXPECT_NE(draw("true").find("did not draw all figures"), std::string::npos);
}

TEST(Plot, CsvHoldsAllDataWithFullDigits) {
  Figure figure{.x_label = "x", .x_max = 1.0};
  figure.panels = {Panel{.title = "T, \"rise\" in K",
                         .bands = {{.legend = "b", .x = {0.5}, .low = {1.0}, .high = {2.0}}},
                         .series = {{.legend = "s", .x = {0.1, 0.3}, .y = {1.0 / 3.0, NAN}}},
                         .levels = {{.label = "l", .y = 7.0}}}};
  EXPECT_EQ(figure_csv(figure),
            "panel,curve,x,y,low,high\n"
            "\"T, \"\"rise\"\" in K\",s,0.1,0.3333333333333333,,\n"
            "\"T, \"\"rise\"\" in K\",s,0.3,,,\n"
            "\"T, \"\"rise\"\" in K\",b,0.5,,1,2\n"
            "\"T, \"\"rise\"\" in K\",l,0,7,,\n"
            "\"T, \"\"rise\"\" in K\",l,1,7,,\n");
}

}  // namespace
}  // namespace photocoag
