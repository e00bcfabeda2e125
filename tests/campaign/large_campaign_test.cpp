// What a campaign of any size needs: sets of spots, sorting and statistics in bounded memory, held
// against the same in memory; a table that is written past HDF5; a disk that is too small.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <set>

#include "photocoag/campaign/campaign_statistics.hpp"
#include "photocoag/campaign/pair_sorter.hpp"
#include "photocoag/campaign/results_file.hpp"
#include "photocoag/campaign/run_campaign.hpp"
#include "photocoag/campaign/spot_set.hpp"
#include "photocoag/campaign/table_statistics.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/population/statistics.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;
using testing::thrown_by;

double random(std::uint64_t k, std::uint64_t seed = 1) {
  return uniform(seed, k, RandomStream::kTest);
}

TEST(SpotSet, IsASetOfNumbers) {
  SpotSet spots;
  std::set<std::uint64_t> plain;
  for (std::uint64_t k = 0; k < 4000; ++k) {
    const auto spot = static_cast<std::uint64_t>(1000.0 * random(k));
    EXPECT_EQ(spots.insert(spot), plain.insert(spot).second) << spot;
  }
  ASSERT_EQ(spots.size(), plain.size());
  ASSERT_LT(plain.size(), 1000U);  // there are gaps
  for (std::uint64_t spot = 0; spot < 1001; ++spot) {
    EXPECT_EQ(spots.contains(spot), plain.contains(spot)) << spot;
    std::uint64_t missing = spot;
    while (plain.contains(missing)) ++missing;
    EXPECT_EQ(spots.next_missing(spot), missing);
  }
  const RowOfSpot row_of(spots);
  std::uint64_t row = 0;
  for (const std::uint64_t spot : plain) EXPECT_EQ(row_of(spot), row++);
}

TEST(SpotSet, SpotsInOrderAreOneInterval) {
  SpotSet spots;
  for (const std::uint64_t spot : {3U, 1U, 0U, 2U, 5U, 4U}) spots.insert(spot);
  ASSERT_EQ(spots.intervals().size(), 1U);
  EXPECT_EQ(spots.intervals()[0].end, 6U);
}

TEST(PairSorter, SortsMoreThanItHolds) {
  const TemporaryFolder folder;
  for (const std::size_t count : {0U, 1U, 100U, 101U, 25'000U}) {
    PairSorter sorter(folder.path(), 100);
    std::vector<KeyedValue> pairs;
    for (std::uint64_t k = 0; k < count; ++k) {
      pairs.push_back({.key = static_cast<std::uint64_t>(500.0 * random(k)), .value = k});
      sorter.add(pairs.back());
    }
    sorter.finish();
    std::sort(pairs.begin(), pairs.end());
    PairSorter::Cursor one(sorter);
    PairSorter::Cursor other(sorter);  // two at a time
    KeyedValue a;
    KeyedValue b;
    for (const KeyedValue& pair : pairs) {
      ASSERT_TRUE(one.next(a) && other.next(b));
      ASSERT_TRUE(a == pair && b == pair) << count;
    }
    EXPECT_FALSE(one.next(a));
    EXPECT_TRUE(fs::is_empty(folder.path())) << "its file has a name";
  }
}

// Rows of one input and all outcomes, filled by `value(row, outcome)`.
std::vector<SpotRecord> records(std::size_t count, auto&& value) {
  std::vector<SpotRecord> all(count);
  for (std::size_t row = 0; row < count; ++row) {
    all[row].spot = row;
    all[row].inputs = {value(row, outcome_columns().size())};
    for (std::size_t i = 0; i < outcome_columns().size(); ++i) {
      all[row].outcomes.push_back(value(row, i));
    }
  }
  return all;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Every kind of column: both signs over many magnitudes, ties, zeros, values that are none.
double awkward(std::size_t row, std::size_t column) {
  const double u = random(row, column + 1);
  switch (column % 6) {
    case 0:
      return (u - 0.5) * std::pow(10.0, std::floor(40.0 * random(row, 99)) - 20.0);
    case 1:
      return std::floor(7.0 * u) - 3.0;
    case 2:
      return u < 0.3 ? kNaN : u < 0.4 ? -kInfinity : u < 0.5 ? kInfinity : u;
    case 3:
      return u < 0.5 ? -0.0 : 0.0;
    case 4:
      return kNaN;
    default:
      return 300.0 + u * 1e-9;
  }
}

TEST(TableStatistics, AreThoseOfTheWholeColumns) {
  const std::vector<double> fractions = {0.0, 0.001, 0.01, 0.5, 0.99, 0.999, 1.0};
  for (const std::size_t count : {0U, 1U, 2U, 1000U, 9001U}) {
    const std::vector<SpotRecord> spots = records(count, awkward);
    const SpotRows rows = rows_of(spots);
    std::vector<RowColumn> columns;
    for (const OutcomeColumn& outcome : outcome_columns()) {
      columns.push_back(outcome_column(outcome.name, 1));
    }
    const auto found = quantiles(rows, columns, fractions);
    const std::vector<ColumnMoments> of = moments(rows, columns);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      std::vector<double> values;
      for (const SpotRecord& spot : spots) values.push_back(spot.outcomes[i]);
      for (std::size_t f = 0; f < fractions.size(); ++f) {
        const double expected = quantile(values, fractions[f]);
        if (std::isnan(expected)) {
          EXPECT_TRUE(std::isnan(found[i][f])) << i;
        } else {
          EXPECT_EQ(found[i][f], expected) << count << " rows, column " << i;
        }
      }
      const auto [mean, deviation] = mean_and_deviation(values);
      EXPECT_TRUE(of[i].mean == mean || (std::isnan(of[i].mean) && std::isnan(mean)));
      EXPECT_TRUE(of[i].deviation == deviation ||
                  (std::isnan(of[i].deviation) && std::isnan(deviation)));
    }
  }
}

TEST(TableStatistics, RankCorrelationsAreThoseInMemory) {
  const TemporaryFolder folder;
  for (const auto levels : {5.0, 1e9}) {  // nearly all ties, hardly any
    const std::vector<SpotRecord> spots = records(5000, [&](std::size_t row, std::size_t column) {
      const double common = random(row);
      return std::floor(levels * (0.3 * common + 0.7 * random(row, column + 2))) / levels - 0.4;
    });
    std::vector<double> x;
    std::vector<double> y;
    for (const SpotRecord& spot : spots) {
      x.push_back(spot.inputs[0]);
      y.push_back(spot.outcomes[outcome_index("over_limit_K")]);
    }
    const double expected = rank_correlation(x, y);
    ASSERT_GT(expected, 0.05);
    for (const std::size_t in_memory : {64U, 10'000U}) {
      // To the bit: sums of ranks are exact below some 300,000 rows.
      EXPECT_EQ(rank_correlations(rows_of(spots), {input_column(0)},
                                  outcome_column("over_limit_K", 1), folder.path(), in_memory)[0],
                expected);
    }
  }
  const std::vector<SpotRecord> constant =
      records(100, [](std::size_t, std::size_t) { return 3.0; });
  EXPECT_EQ(rank_correlations(rows_of(constant), {input_column(0)},
                              outcome_column("over_limit_K", 1), folder.path(), 10)[0],
            0.0);
}

TEST(CampaignStatistics, TheWorstSpotsAreTheHighestInTheirOrder) {
  const TemporaryFolder folder;
  const std::size_t over = outcome_index("over_limit_K");
  const std::vector<SpotRecord> spots = records(3000, [over](std::size_t row, std::size_t column) {
    return column == over ? std::floor(100.0 * random(row)) : random(row, column + 2);
  });
  const CampaignStatistics all = campaign_statistics(rows_of(spots), folder.path(), 500);
  std::vector<SpotRecord> sorted = spots;
  std::stable_sort(sorted.begin(), sorted.end(), [over](const auto& a, const auto& b) {
    return a.outcomes[over] > b.outcomes[over];
  });
  ASSERT_EQ(all.worst.size(), CampaignStatistics::kWorst);
  for (std::size_t i = 0; i < all.worst.size(); ++i) EXPECT_EQ(all.worst[i].spot, sorted[i].spot);
  // The mean of the input over the spots at or above the 99 % quantile.
  std::vector<double> peaks;
  for (const SpotRecord& spot : spots) peaks.push_back(spot.outcomes[over]);
  const double threshold = quantile(peaks, 0.99);
  std::vector<double> tail;
  for (const SpotRecord& spot : spots) {
    if (spot.outcomes[over] >= threshold) tail.push_back(spot.inputs[0]);
  }
  EXPECT_EQ(all.inputs[0].tail_mean, mean_and_deviation(tail).first);
  double percent = 0.0;
  for (const double share : all.histograms[0].percent) percent += share;
  EXPECT_NEAR(percent, 100.0, 1e-9);  // rounding of 3,000 sums
}

Campaign campaign_of(const TemporaryFolder& folder, std::uint64_t spots) {
  write_file(folder.file("campaign.toml"),
             "spots = " + std::to_string(spots) +
                 "\nset = [\"run.duration_ms=20\", \"plant.model=reduced\"]\n[[input]]\n"
                 "key = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.4\n"
                 "high = 1.4\n");
  return load_campaign(folder.file("campaign.toml"));
}

TEST(ResultsFile, HoldsTheJournalsSpotsByNumber) {
  const TemporaryFolder folder;
  const Campaign campaign = campaign_of(folder, 30'000);
  const std::vector<SpotRecord> spots =
      records(30'000, [](std::size_t row, std::size_t column) { return random(row, column); });
  Journal journal(folder.path() / "journal.bin", campaign);
  std::vector<std::size_t> there;
  for (std::size_t k = 0; k < 20'000; ++k) {  // in no order, some of them never
    there.push_back(static_cast<std::size_t>(30'000.0 * random(k, 77)));
    journal.append(spots[there.back()]);
  }
  std::sort(there.begin(), there.end());
  there.erase(std::unique(there.begin(), there.end()), there.end());
  write_file(folder.file("campaign.h5.part"), "what a killed program has left");
  write_results(folder.file("campaign.h5"), campaign, journal);
  EXPECT_FALSE(fs::exists(folder.file("campaign.h5.part")));
  const SpotRows rows = open_results(folder.file("campaign.h5"), campaign);
  ASSERT_EQ(rows.count, there.size());
  std::size_t row = 0;
  rows.for_each([&](const double* block) {
    const SpotRecord record = from_block(block, 1);
    ASSERT_EQ(record.spot, there[row]);
    ASSERT_EQ(record.inputs, spots[there[row]].inputs);
    ASSERT_EQ(record.outcomes, spots[there[row]].outcomes);
    ++row;
  });
}

TEST(LargeCampaign, IsRefusedIfTheDiskHasNoRoomForIt) {
  const TemporaryFolder folder;
  const Campaign campaign = campaign_of(folder, 1'000'000'000'000'000);  // some 400 PB
  Ranks ranks;
  const std::atomic<bool> stop{true};
  const fs::path out = folder.path() / "out";
  const ErrorParts error =
      thrown_by([&] { run_campaign(campaign, {.out = out, .threads = 1}, ranks, stop); });
  EXPECT_EQ(error.where, out.string());
  EXPECT_NE(error.problem.find("no room"), std::string::npos);
  EXPECT_NE(error.accepted.find("bytes a spot"), std::string::npos) << error.accepted;
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace photocoag
