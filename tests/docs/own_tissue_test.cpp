// The page about a user's own tissue, executed from its first command to its last.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "docs/documents.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

struct Row {
  double peak_K;
  double volume_K;
};

std::vector<Row> rows_of(const fs::path& csv) {
  std::istringstream lines(text_of(csv));
  std::vector<Row> rows;
  std::string line;
  std::getline(lines, line);  // names
  while (std::getline(lines, line)) {
    const std::size_t peak = line.find(',') + 1;
    rows.push_back({std::stod(line.substr(peak)), std::stod(line.substr(line.rfind(',') + 1))});
  }
  return rows;
}

TEST(OwnTissue, EveryCommandOfThePageRuns) {
  const TemporaryFolder folder;
  const fs::path& work = folder.path();
  fs::create_directory_symlink(source_folder() / "examples", work / "examples");
  int commands = 0;
  for (const std::string& line :
       lines_of(text_of(source_folder() / "docs" / "own-tissue.md"), true, "sh")) {
    if (line.rfind("./photocoag ", 0) != 0) continue;
    SCOPED_TRACE(line);
    const std::string shell = "cd '" + work.string() +
                              "' && XDG_CACHE_HOME=\"$PWD/cache\" '" PHOTOCOAG_PROGRAM "' " +
                              line.substr(12) + " >out.txt 2>&1";
    ASSERT_EQ(std::system(shell.c_str()), 0) << text_of(work / "out.txt");
    ++commands;
  }
  EXPECT_EQ(commands, 6);
  const std::vector<Row> full = rows_of(work / "full.csv");
  const std::vector<Row> reduced = rows_of(work / "reduced.csv");
  ASSERT_EQ(full.size(), 3U);
  ASSERT_EQ(reduced.size(), 3U);
  for (std::size_t i = 0; i < full.size(); ++i) {
    // The page says 1.59 % of the largest value.
    EXPECT_NEAR(reduced[i].peak_K, full[i].peak_K, 0.016 * full.back().peak_K);
    EXPECT_NEAR(reduced[i].volume_K, full[i].volume_K, 0.016 * full.back().volume_K);
  }
  EXPECT_TRUE(fs::exists(work / "own-run" / "report.html"));
}

}  // namespace
}  // namespace photocoag::testing
