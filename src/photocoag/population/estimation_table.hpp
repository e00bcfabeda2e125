// Role: offline; the table of `photocoag estimation`. Units: in its headings.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "photocoag/population/estimation_study.hpp"

namespace photocoag {

/// Two lines of headings.
std::string estimation_heading();

/// One line: the mean over cycles [begin, end) of `period` seconds. A number too wide for its
/// column is written with an exponent, so that columns stay in line and apart. Test:
/// tests/population/estimation_table_test.cpp.
std::string estimation_row(std::string_view name, const EstimationCycle& mean, double period,
                           std::size_t begin, std::size_t end);

}  // namespace photocoag
