// Campaigns beside each other: what is read, who is beaten, what is drawn.
#include "photocoag/campaign/pareto.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "photocoag/core/files.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;
using testing::thrown_by;

ParetoPoint point(const std::string& name, double held, std::uint64_t violations) {
  return {.name = name,
          .campaign = "",
          .spots = 1000,
          .violations = violations,
          .probability = static_cast<double>(violations) / 1000.0,
          .probability_low = 0.0,
          .probability_high = 0.01,
          .held_mean = held,
          .peak_reference = 30.0};
}

std::string summary(const std::string& held) {
  return R"({"campaign": "a.toml", "spots": 4, "over_limit_spots": 1, "over_limit_probability": 0.25,
    "over_limit_probability_low": 0.01, "over_limit_probability_high": 0.8, "held_mean_error_K": )" +
         held + R"(, "held_std_error_K": 1.5, "held_half_mean_error_K": -0.4,
    "reached_95_percent": 0.75, "stopped_spots": 0, "peak_max_K": 33.0, "peak_reference_K": 30.0,
    "limit_K": 32.0})";
}

TEST(Pareto, TheFrontIsWhatNoOtherCampaignBeatsInBoth) {
  const std::vector<ParetoPoint> points = {point("nominal", -0.4, 130), point("chance", -2.0, 1),
                                           point("beaten", -2.5, 2), point("certified", -6.8, 0),
                                           point("stopped", std::nan(""), 0)};
  EXPECT_EQ(pareto_front(points), (std::vector<std::size_t>{3, 1, 0}));
}

TEST(Pareto, AnotherReferenceIsComparedByThePeakItself) {
  ParetoPoint low = point("28.5 K", 0.0, 1);
  low.peak_reference = 28.5;
  const std::vector<ParetoPoint> points = {low, point("30 K", -1.0, 1)};
  EXPECT_EQ(pareto_front(points), std::vector<std::size_t>{1}) << "29 K beats 28.5 K";
}

TEST(Pareto, NoViolationIsDrawnBelowEveryPossibleShare) {
  const Figure figure = pareto_figure({point("nominal", -0.4, 130), point("certified", -6.8, 0)});
  ASSERT_TRUE(figure.panels[0].y_log);
  EXPECT_LE(*figure.panels[0].y_min, 0.05);  // %: half of one eye of a thousand
  EXPECT_LT(figure.x_min, 23.2);
  EXPECT_GT(figure.x_max, 29.6);
  EXPECT_FALSE(figure_svg(figure, SvgKind::kStandAlone).empty());
}

TEST(Pareto, ReadsSummariesAndWritesThePage) {
  const TemporaryFolder folder;
  for (const char* const name : {"one", "two"}) {
    fs::create_directories(folder.file(name));
    write_file(folder.file(name) + "/campaign.h5", "");
  }
  write_file(folder.file("one") + "/summary.json", summary("-0.5"));
  write_file(folder.file("two") + "/summary.json", summary("null"));
  EXPECT_TRUE(is_campaign_folder(folder.file("one")));
  EXPECT_FALSE(is_campaign_folder(folder.file("three")));
  const ParetoPoint one = read_pareto_point(folder.file("one") + "/");
  EXPECT_EQ(one.name, "one");
  EXPECT_EQ(one.violations, 1U);
  EXPECT_EQ(one.held_mean, -0.5);
  EXPECT_TRUE(std::isnan(read_pareto_point(folder.file("two")).held_mean));
  compare_campaigns({folder.file("one"), folder.file("two")}, folder.file("out"));
  const std::string table = read_file(folder.file("out") + "/tables.md", 100'000);
  EXPECT_NE(table.find("| one | 4 | 1 | 25 | 1 to 80 | -0.500 | 1.500 | -0.400 | 75.0 |"),
            std::string::npos)
      << table;
  for (const char* const file : {"index.html", "compare.svg", "compare.csv"}) {
    EXPECT_TRUE(fs::exists(folder.file("out") + "/" + file)) << file;
  }
}

TEST(Pareto, TheOfflineBoundIsDrawnAndBeatsNobody) {
  const TemporaryFolder folder;
  for (const char* const name : {"one", "bound"}) fs::create_directories(folder.file(name));
  write_file(folder.file("one") + "/campaign.h5", "");
  write_file(folder.file("one") + "/summary.json", summary("-0.5"));
  write_file(folder.file("bound") + "/offline-bound.json",
             R"({"spots": 200, "campaign": "a.toml", "peak_reference_K": 30.0, "limit_K": 32.0,
                 "points": [{"limit_probability": 0.01, "over_limit_spots": 2,
                             "held_mean_error_K": -0.4, "held_std_error_K": 0.9}]})");
  EXPECT_TRUE(is_campaign_folder(folder.file("bound")));
  compare_campaigns({folder.file("one"), folder.file("bound")}, folder.file("out"));
  const std::string table = read_file(folder.file("out") + "/tables.md", 100'000);
  EXPECT_NE(table.find("| bound, 1 % | 200 | 2 | 1 | 0.121 to 3.57 | -0.400 | 0.900 |  |  | 0 |"),
            std::string::npos)
      << table;
  ParetoPoint bound = point("bound", -0.1, 0);
  bound.is_bound = true;
  EXPECT_EQ(pareto_front({point("nominal", -0.4, 130), bound}), std::vector<std::size_t>{0});
  write_file(folder.file("bound") + "/offline-bound.json", "{}");
  EXPECT_EQ(thrown_by([&] { compare_campaigns({folder.file("bound")}, folder.file("other")); }).key,
            "points");
}

TEST(Pareto, ABadSummaryIsNamed) {
  const TemporaryFolder folder;
  const std::string file = folder.file("summary.json");
  write_file(file, "{\"campaign\": \"a.toml\", \"spots\": \"many\"}");
  const ErrorParts error = thrown_by([&] { read_pareto_point(folder.path()); });
  EXPECT_EQ(error.key, "spots");
  EXPECT_EQ(error.found, "\"many\"");
  EXPECT_EQ(error.where, file);
  write_file(file, "nothing");
  EXPECT_EQ(thrown_by([&] { read_pareto_point(folder.path()); }).where, file);
}

}  // namespace
}  // namespace photocoag
