// The rows of the fault table that need processes, the disk or the program itself, with fewer kills
// and allocations than `photocoag faults`. Plus the two tables together: no row is missing.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "photocoag/fault_table/process_trials.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag {
namespace {

ProcessFaultOptions quick(const std::string& row) {
  return {.only = row,
          .absorptions = {1.1},
          .min_cells = 10000,
          .kills = 4,
          .allocation_step = 499,
          .program = PHOTOCOAG_PROGRAM,
          .shim = PHOTOCOAG_SHIM};
}

class ProcessFaultTable : public ::testing::TestWithParam<std::string> {};

TEST_P(ProcessFaultTable, EveryRunOfTheRowPasses) {
  const std::vector<FaultRow> rows = run_process_faults(quick(GetParam()));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_GT(rows.front().runs, 0);
  EXPECT_EQ(rows.front().passed, rows.front().runs) << rows.front().first_failure;
}

INSTANTIATE_TEST_SUITE_P(Rows, ProcessFaultTable, ::testing::ValuesIn(process_fault_ids()),
                         [](const auto& row) { return row.param; });

TEST(ProcessFaultInstrument, ItsPathMayHoldBlanksAndColons) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path odd = folder.path() / "a b:c";
  std::filesystem::create_directory(odd);
  std::filesystem::copy_file(PHOTOCOAG_SHIM, odd / "shim.so");
  for (const char* row : {"T6", "X3"}) {
    ProcessFaultOptions options = quick(row);
    options.shim = (odd / "shim.so").string();
    options.allocation_step = 1'000'000;
    const std::vector<FaultRow> rows = run_process_faults(options);
    EXPECT_EQ(rows.at(0).passed, rows.at(0).runs) << row << ": " << rows.at(0).first_failure;
  }
}

TEST(ProcessFaultInstrument, WithoutItTheRowFails) {
  for (const char* row : {"T6", "X3"}) {
    ProcessFaultOptions options = quick(row);
    options.shim += ".gone";
    const std::vector<FaultRow> rows = run_process_faults(options);
    EXPECT_GT(rows.at(0).runs, 0) << row;
    EXPECT_EQ(rows.at(0).passed, 0) << row;
  }
}

TEST(ProcessFaultTableAsAWhole, WithoutTheSupervisorItsRowsFail) {
  ProcessFaultOptions options = quick("");
  options.supervised = false;
  const std::vector<FaultRow> rows = run_process_faults(options);
  std::set<std::string> ids;
  for (const FaultRow& row : rows) {
    ids.insert(row.id);
    EXPECT_LT(row.passed, row.runs) << row.id;
  }
  EXPECT_EQ(ids, (std::set<std::string>{"T3", "F3", "L1"}));
}

TEST(ProcessFaultTableAsAWhole, BothTablesTogetherHaveEveryRow) {
  std::set<std::string> ids;
  for (const FaultCase& test : fault_table()) ids.insert(test.id);
  for (const std::string& id : process_fault_ids()) ids.insert(id);
  EXPECT_EQ(ids, (std::set<std::string>{
                     "M1",  "M2",  "M3",  "M4",  "M5",  "M6",  "M7",  "M8", "M9", "A1", "A2", "A3",
                     "A4",  "A5",  "S1",  "S2",  "S3",  "S4",  "S5",  "E1", "E2", "E3", "E4", "T1",
                     "T2",  "T3",  "T4",  "T5",  "T6",  "T7",  "F1",  "F2", "F3", "L1", "L2", "X1",
                     "X2",  "X3",  "X4",  "O1",  "O2",  "O3",  "O4",  "O5", "O6", "O7", "O8", "O9",
                     "O10", "O11", "O12", "O13", "O14", "O15", "O16", "O17"}));
}

}  // namespace
}  // namespace photocoag
