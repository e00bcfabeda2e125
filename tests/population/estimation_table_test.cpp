// The table of `photocoag estimation`: columns in line and apart, whatever the numbers are.
#include "photocoag/population/estimation_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <vector>

namespace photocoag {
namespace {

// Where the words of a line end.
std::vector<std::size_t> ends(const std::string& line) {
  std::vector<std::size_t> at;
  for (std::size_t k = 1; k <= line.size(); ++k)
    if (line[k - 1] > ' ' && (k == line.size() || line[k] <= ' ')) at.push_back(k);
  return at;
}

EstimationCycle all_fields(double value) {
  EstimationCycle mean;
  for (double* field : {&mean.nis, &mean.nees, &mean.nees_alpha, &mean.nees_peak, &mean.rms_alpha,
                        &mean.sigma_alpha, &mean.rms_peak, &mean.rejected})
    *field = value;
  return mean;
}

TEST(EstimationTable, ColumnsStayInLineAndApartForEveryNumber) {
  std::istringstream heading(estimation_heading());
  std::string above, below;
  std::getline(heading, above);
  std::getline(heading, below);
  // "scenario", "ms" and eight columns, one of them with a heading of two words.
  std::vector<std::size_t> columns = ends(below);
  columns.erase(columns.begin(), columns.begin() + 2);
  columns.erase(columns.end() - 2);  // "ed" of "ed %"
  columns.erase(columns.end() - 3);  // "rms" of "rms K"
  std::erase(columns, below.find("rms %") + 3);
  ASSERT_EQ(columns.size(), 8U) << below;
  for (const double value : {1e-300, 0.004, 1.0, 99.999, 1234.5, 3e5, 301234.567, 1e12, 1e97,
                             static_cast<double>(INFINITY)}) {
    std::string row =
        estimation_row("full-order eye, +5 K from half on", all_fields(value), 1e-3, 125, 250);
    row.pop_back();
    std::vector<std::size_t> found = ends(row);
    ASSERT_EQ(found.size(), 7U + 3U + 8U) << row;  // of the name, of "126 to 250", the numbers
    found.erase(found.begin(), found.begin() + 10);
    EXPECT_EQ(found, columns) << below << '\n' << row;
  }
}

TEST(EstimationTable, WideNumbersKeepTheirSize) {
  EstimationCycle mean = all_fields(1.0);
  mean.nees = 301234.567;
  mean.nees_alpha = 123456.78;
  const std::string row = estimation_row("", mean, 1e-3, 0, 250);
  EXPECT_NE(row.find(" 3.01e+05 1.23e+05 "), std::string::npos) << row;
  mean.nees_alpha = 12345.67;
  EXPECT_NE(estimation_row("", mean, 1e-3, 0, 250).find(" 12345.67 "), std::string::npos);
}

TEST(EstimationTable, NoFullErrorWhereThereIsNoReducedState) {
  EstimationCycle mean = all_fields(1.0);
  mean.nees = 0.0;
  EXPECT_NE(estimation_row("", mean, 1e-3, 0, 250).find("    1.000        -     1.00"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag
