// Figures: properties of the drawing, not its look.
#include "photocoag/page/figure.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "photocoag/core/error.hpp"
#include "report/run_folder.hpp"

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
  return figure_svg(figure, kind);
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

TEST(Plot, IsWellFormedAndEscaped) {
  for (const SvgKind kind : {SvgKind::kInline, SvgKind::kStandAlone}) {
    const std::string svg = render(example(), kind);
    EXPECT_EQ(xml_problem(svg), "");
    for (const std::string part : {"rgb(", " id=", "xlink", "<script", "url(", "nan", "inf"})
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
    const std::string css = figure_css(kind);
    EXPECT_NE(css.find("prefers-color-scheme:dark"), std::string::npos);
    for (std::size_t at = svg.find("class=\"pc-"); at != std::string::npos;
         at = svg.find("class=\"pc-", at + 1)) {
      const std::size_t begin = at + 7;
      const std::string name = svg.substr(begin, svg.find_first_of("\" ", begin) - begin);
      EXPECT_NE(css.find("." + name), std::string::npos) << name;
    }
  }
  EXPECT_EQ(figure_css(SvgKind::kStandAlone).find("var("), std::string::npos);
}

TEST(Plot, SameDataSameBytes) { EXPECT_EQ(render(example()), render(example())); }

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
  // px have two digits.
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

// The numbers of a data-… attribute, the first of its name after `at`.
std::vector<double> numbers(const std::string& svg, const std::string& name, std::size_t at = 0) {
  const std::size_t begin = svg.find(" data-" + name + "=\"", at) + name.size() + 8;
  std::istringstream text(svg.substr(begin, svg.find('"', begin) - begin));
  std::vector<double> values;
  for (std::string word; text >> word;) values.push_back(word == "n" ? NAN : std::stod(word));
  return values;
}

TEST(Plot, CarriesTheNumbersOfItsCurvesAndNoneAsAFile) {
  Figure figure{.x_label = "time in ms", .x_max = 3.0};
  figure.panels = {
      Panel{.bands = {{.x = {0, 1}, .low = {1, 2}, .high = {3, 4}}},
            .series = {{.legend = "a", .x = {0, 1, 2, 3}, .y = {1.25, NAN, 2.0 / 3.0, 3}}}}};
  const std::string svg = render(figure);
  EXPECT_EQ(numbers(svg, "y"), (std::vector<double>{1, 2}));
  EXPECT_EQ(numbers(svg, "z"), (std::vector<double>{3, 4}));
  const std::size_t series = svg.find("data-n=\"a\"");
  EXPECT_EQ(numbers(svg, "x", series), (std::vector<double>{0, 1, 2, 3}));
  const std::vector<double> y = numbers(svg, "y", series);
  ASSERT_EQ(y.size(), 4U);
  EXPECT_EQ(y[0], 1.25);
  EXPECT_TRUE(std::isnan(y[1]));
  EXPECT_NEAR(y[2], 2.0 / 3.0, 1e-6);
  EXPECT_EQ(render(figure, SvgKind::kPicture).find("data-y"), std::string::npos);
  EXPECT_EQ(render(figure, SvgKind::kStandAlone).find("data-y"), std::string::npos);
}

// The points of the path after `at`.
std::vector<std::pair<double, double>> points(const std::string& svg, std::size_t at) {
  const std::size_t begin = svg.find(" d=\"", at) + 4;
  std::string text = svg.substr(begin, svg.find('"', begin) - begin);
  for (std::size_t dot; (dot = text.find("h0")) != std::string::npos;) text.erase(dot, 2);
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c >= 'A'; }, ' ');
  std::istringstream words(text);
  std::vector<std::pair<double, double>> all;
  for (double x = 0.0, y = 0.0; words >> x >> y;) all.emplace_back(x, y);
  return all;
}

// Whatever the data, nothing is drawn outside of the axes, and lines meet the edge where they cross
// it.
TEST(Plot, NothingLeavesThePanel) {
  for (const Mark mark : {Mark::kLine, Mark::kSteps, Mark::kBars, Mark::kPoints}) {
    Figure figure{.x_label = "x", .x_min = 10.0, .x_max = 20.0, .width = 258.0};
    Series series = wave(40);
    for (double& y : series.y) y *= 40.0;
    series.mark = mark;
    const Band band{.x = series.x, .low = series.y, .high = wave(40).y, .ink = Ink::kSeries4};
    figure.panels = {Panel{.bands = {band}, .series = {series}, .y_min = 4.0, .y_max = 7.0}};
    const std::string svg = render(figure);
    const std::vector<double> view = numbers(svg, "view"), panel = numbers(svg, "panel");
    for (const char* curve : {"data-m=\"band\"", "data-n=\"wave\""}) {
      const std::size_t found = svg.find(curve);
      const auto drawn = points(svg, svg.rfind("<path", found));
      EXPECT_GT(drawn.size(), 4U) << curve;
      for (const auto& [x, y] : drawn) {
        EXPECT_TRUE(x >= view[2] - 0.01 && x <= view[3] + 0.01) << x;
        EXPECT_TRUE(y >= panel[0] - 0.01 && y <= panel[1] + 0.01) << y;
      }
    }
    if (mark != Mark::kLine) continue;
    // 40 sin(0.01 x) is 4.0 at x = 10.017, 7.0 at x = 17.59.
    const auto drawn = points(svg, svg.rfind("<path", svg.find("data-n=\"wave\"")));
    const double px = (view[3] - view[2]) / 10.0;
    EXPECT_NEAR(drawn.front().first, view[2] + 0.0167 * px, 0.05);
    EXPECT_NEAR(drawn.front().second, panel[1], 0.02);
    EXPECT_NEAR(drawn.back().first, view[2] + 7.591 * px, 0.05);
    EXPECT_NEAR(drawn.back().second, panel[0], 0.02);
  }
}

TEST(Plot, BarsStandOnTheAxisOverTheirEdges) {
  Figure figure{.x_label = "x", .x_max = 2.0, .width = 258.0, .panel_height = 200.0};
  figure.panels = {Panel{.series = {{.x = {0, 1, 2}, .y = {0, 5, 10}, .mark = Mark::kBars}},
                         .y_min = 0.0,
                         .y_max = 10.0}};
  const std::string svg = render(figure);
  const std::vector<double> panel = numbers(svg, "panel");
  const double base = panel[1], top = panel[0], half = 0.5 * (base + top);
  using Points = std::vector<std::pair<double, double>>;
  EXPECT_EQ(points(svg, svg.find("class=\"pc-area-series-1 pc-line-series-1\"")),
            (Points{{46, base}, {46, half}, {146, half}, {146, top}, {246, top}, {246, base}}));
}

TEST(Plot, OnEqualScalesAnIsolineOfAConeIsRound) {
  GridField cone;
  for (int k = -50; k <= 50; ++k) {
    cone.x.push_back(k);
    cone.y.push_back(k);
  }
  for (const double y : cone.y)
    for (const double x : cone.x) cone.values.push_back(100.0 - std::hypot(x, y));
  Figure figure{.x_min = -50.0, .x_max = 50.0, .mirrored = true, .equal_scale = true};
  figure.panels = {Panel{.levels = {{.label = "surface", .y = -40.0, .label_below = true}},
                         .contours = {{"70", isolines(cone, 70.0)}},
                         .y_min = -50.0,
                         .y_max = 50.0,
                         .y_down = true}};
  const std::string svg = render(figure);
  const std::vector<double> view = numbers(svg, "view"), panel = numbers(svg, "panel");
  const double px = (view[3] - view[2]) / 100.0;
  EXPECT_NEAR(panel[1] - panel[0], 100.0 * px, 0.01);
  const auto ring = points(svg, svg.find("class=\"pc-area-series-2"));
  EXPECT_GT(ring.size(), 100U);
  for (const auto& [x, y] : ring)
    EXPECT_NEAR(std::hypot(x - view[2] - 50.0 * px, y - panel[0] - 50.0 * px), 30.0 * px, 0.05);
  const std::string across = svg.substr(0, svg.find("data-axis=\"y\""));
  EXPECT_NE(across.find(">20<"), std::string::npos);
  for (const char* sign : {">-20<", ">−20<"})
    EXPECT_EQ(across.find(sign), std::string::npos) << "no sign at the ticks of a mirrored axis";
  EXPECT_NE(svg.find(">−20<"), std::string::npos) << "a true minus at the other";
  // A depth: -40 lies near the top.
  EXPECT_NE(svg.find(fmt::format("y=\"{:.2f}\" text-anchor=\"end\" data-level=\"-40\">surface",
                                 panel[0] + 10 * px + 13)),
            std::string::npos);
  EXPECT_EQ(svg.find("data-y"), std::string::npos) << "a field has no curve to read";
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
