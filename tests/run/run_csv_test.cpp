// run.csv by the table of fields: what is written comes back, and the document lists it.
#include "photocoag/run/run_csv.hpp"

#include <gtest/gtest.h>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag {
namespace {

Treatment of_one_cycle() {
  Treatment treatment;
  treatment.device = DeviceReport{};
  LogRecord record;
  std::uint64_t number = 0;
  for (const CycleField& field : cycle_fields()) {
    const std::string cell = field.type == FieldType::kReal      ? std::to_string(++number) + ".5"
                             : field.type == FieldType::kInteger ? "1"
                                                                 : std::string(field.word(2));
    EXPECT_TRUE(set_cell(field, cell, record)) << field.name;
  }
  treatment.records.push_back(record);
  return treatment;
}

TEST(RunCsv, ReadsBackWhatItWrote) {
  const testing::TemporaryFolder folder;
  const std::string text = run_csv(of_one_cycle(), true);
  write_file(folder.file("run.csv"), text);
  const RunCsv run = read_run_csv(folder.file("run.csv"));
  Treatment again;
  again.device = DeviceReport{};
  again.records.assign(run.cycles.begin(), run.cycles.end());
  EXPECT_EQ(run_csv(again, true), text);
}

TEST(RunCsv, NamesTheCellThatIsNoNumberOrNoWord) {
  const testing::TemporaryFolder folder;
  for (const char* text : {"cycle,power_W\n0,1e-3x\n", "cycle,solver_status\n0,solvd\n",
                           "cycle,overrun\n0,0.5\n", "cycle,power_W\n0\n"}) {
    write_file(folder.file("run.csv"), text);
    try {
      read_run_csv(folder.file("run.csv"));
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_TRUE(error.parts().where.ends_with("run.csv:2")) << error.what();
    }
  }
}

// The rows "| `name` | unit | … |" below the heading "## run.csv".
TEST(RunCsv, TheDocumentListsItsColumnsInTheirOrder) {
  const std::string file = PHOTOCOAG_SOURCE_DIR "/docs/run-folder.md";
  const std::string text = read_file(file, std::size_t{1} << 20U, "document");
  std::size_t at = text.find("## run.csv");
  for (const CycleField& field : cycle_fields()) {
    if (field.in_csv == InCsv::kNo) continue;
    const std::string row = "\n| `" + std::string(field.name) + "` | ";
    const std::size_t next = text.find(row, at);
    ASSERT_NE(next, std::string::npos) << field.name;
    const std::size_t start = next + row.size();
    const std::string unit = text.substr(start, text.find(" |", start) - start);
    EXPECT_TRUE(unit == field.unit || (field.unit == "1" && (unit == "-" || unit == "0, 1")))
        << field.name << ": " << unit;
    at = next;
  }
}

}  // namespace
}  // namespace photocoag
