// The fault table of docs/safety.md: one test per row, on the full-order eye, in virtual time.
#include <gtest/gtest.h>

#include <set>

#include "photocoag/faults/faulty_device.hpp"
#include "photocoag/trials/fault_trials.hpp"

namespace photocoag {
namespace {

std::vector<std::string> ids() {
  std::vector<std::string> list;
  for (const FaultCase& test : fault_table()) {
    if (list.empty() || list.back() != test.id) list.push_back(test.id);
  }
  return list;
}

class FaultTable : public ::testing::TestWithParam<std::string> {};

TEST_P(FaultTable, EveryRunOfTheRowPasses) {
  const std::vector<FaultRow> rows = run_fault_table({.only = GetParam()});
  ASSERT_EQ(rows.size(), 1u);
  const FaultRow& row = rows.front();
  EXPECT_EQ(row.passed, row.runs) << row.first_failure;
  EXPECT_EQ(row.false_stops, 0);
  // Three absorptions, two horizons, five moments (X1 has none of its own).
  EXPECT_EQ(row.runs % (row.id == "X1" ? 6 : 30), 0);
}

INSTANTIATE_TEST_SUITE_P(Rows, FaultTable, ::testing::ValuesIn(ids()),
                         [](const auto& row) { return row.param; });

TEST(FaultTableAsAWhole, HasEveryRowOfVirtualTime) {
  const std::vector<std::string> list = ids();
  const std::set<std::string> expected = {"M1", "M2", "M3", "M4", "M5", "M6", "M7", "M8", "M9",
                                          "A1", "A2", "A3", "A4", "A5", "S1", "S2", "S3", "S4",
                                          "E1", "E2", "E3", "E4", "T1", "T2", "X1", "X4"};
  EXPECT_EQ(std::set<std::string>(list.begin(), list.end()), expected);
  EXPECT_EQ(list.size(), expected.size()) << "the cases of a row stand together";
}

TEST(FaultTableAsAWhole, WithoutTheSupervisorEveryRowFails) {
  // One absorption and horizon are enough: each row must fail somewhere.
  const std::vector<FaultRow> rows = run_fault_table(
      {.supervised = false, .min_cells = 10000, .absorptions = {1.1}, .horizons = {5}, .only = {}});
  EXPECT_EQ(rows.size(), ids().size());
  for (const FaultRow& row : rows) EXPECT_LT(row.passed, row.runs) << row.id;
}

TEST(FaultTableAsAWhole, HealthyTreatmentsAreNotStopped) {
  // `photocoag faults --healthy 10000` is the same with more of them.
  const FalseStops stops = count_false_stops(300, 10000);
  EXPECT_EQ(stops.treatments, 300);
  EXPECT_EQ(stops.stopped, 0) << stops.first_reason;
  EXPECT_LT(stops.peak, 32.0);
}

}  // namespace
}  // namespace photocoag
