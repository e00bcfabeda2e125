// The figures of the cycles' durations: no entry is lost, and the words are right.
#include "photocoag/report/timing_figures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace photocoag {
namespace {

using Histogram = RunSummary::Histogram;

Figure figure_of(const Histogram& histogram) {
  const auto figures = timing_figures({histogram});
  EXPECT_EQ(figures.size(), 1U);
  return figures.at(0);
}

// Entries in the drawn columns.
double drawn_entries(const Figure& figure) {
  const Series& bars = figure.panels.at(0).series.at(0);
  EXPECT_EQ(bars.mark, Mark::kBars);
  EXPECT_EQ(bars.y.at(0), 0.0);
  return std::accumulate(bars.y.begin(), bars.y.end(), 0.0);
}

TEST(TimingFigures, EveryEntryIsInAColumnInView) {
  for (const std::int64_t spread : {1, 7, 79, 80, 81, 161, 401, 1999, 123456789}) {
    for (const std::int64_t first : {std::int64_t{0}, std::int64_t{3}, 3 * spread + 1}) {
      const Figure figure = figure_of(
          {"wake_us", {{first, 5}, {first + spread / 2 + 1, 7}, {first + spread + 1, 11}}});
      EXPECT_EQ(drawn_entries(figure), 23.0) << first << " " << spread;
      const Series& bars = figure.panels[0].series[0];
      EXPECT_LE(bars.x.size(), 82U);
      EXPECT_LE(figure.x_min, static_cast<double>(first));
      EXPECT_GT(figure.x_max, static_cast<double>(first + spread + 1));
      EXPECT_LE(figure.x_min, bars.x.front());
      EXPECT_GT(figure.x_max, bars.x.back());
      // A column is 1, 2 or 5 times a power of ten wide.
      const double width = bars.x[1] - bars.x[0];
      const double leading = width / std::pow(10.0, std::floor(std::log10(width) + 1e-9));
      EXPECT_TRUE(leading == 1.0 || leading == 2.0 || leading == 5.0) << width;
    }
  }
}

TEST(TimingFigures, AColumnAddsItsBinsUp) {
  const Figure figure =
      figure_of({"compute_us", {{0, 1}, {3, 2}, {4, 4}, {5, 8}, {399, 1}}});  // columns of 5 us
  const Series& bars = figure.panels[0].series[0];
  EXPECT_EQ(figure.panels[0].title, "Compute: cycles per 5 µs");
  EXPECT_EQ(bars.y[1], 7.0);  // [0, 5)
  EXPECT_EQ(bars.y[2], 8.0);  // [5, 10)
  EXPECT_EQ(bars.y[3], 0.0);
  EXPECT_TRUE(figure.panels[0].y_log);
}

TEST(TimingFigures, SayWhatIsInNoBin) {
  const Figure figure =
      figure_of({.name = "slack_us", .bins = {{912, 3}, {915, 57}}, .below_0 = 4, .overflow = 2});
  EXPECT_EQ(figure.panels[0].title, "Slack: cycles per 1 µs; 4 below 0; 2 above all bins");
  EXPECT_NE(figure.description.find("most (57) from 915 to 916 µs"), std::string::npos)
      << figure.description;
  EXPECT_EQ(figure.x_label, "µs");
  EXPECT_EQ(figure.x_min, 911.0);
}

TEST(TimingFigures, NothingToDrawWithoutEntries) {
  EXPECT_TRUE(timing_figures({}).empty());
  EXPECT_TRUE(timing_figures({{.name = "write_us", .bins = {}, .without = 60}}).empty());
}

}  // namespace
}  // namespace photocoag
