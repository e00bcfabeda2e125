// The whole fault table of docs/safety.md in virtual time: five absorptions, two horizons, 1 kHz
// and 250 Hz, with and without a delayed command. tests/trials has a part of it.
#include <gtest/gtest.h>

#include "photocoag/trials/fault_trials.hpp"

namespace photocoag {
namespace {

TEST(WholeFaultTable, EveryRunPasses) {
  for (const FaultRow& row : run_fault_table({.min_cells = 10000, .overrides = {}, .only = {}})) {
    EXPECT_EQ(row.passed, row.runs) << row.id << ": " << row.first_failure;
    EXPECT_EQ(row.false_stops, 0) << row.id;
  }
}

}  // namespace
}  // namespace photocoag
