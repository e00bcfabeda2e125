// Role: the program; declarations shared by the two files of `estimation`.
#pragma once

#include <string>

#include "options.hpp"

namespace photocoag {

struct EstimationOptions : CommonOptions {
  int seeds = 200;
  std::string csv;       ///< file; - is standard output; may be empty
  bool compare = false;  ///< filter against moving horizon, one and two unknowns
  std::string out;       ///< of the comparison: folder for figure and CSV; may be empty
};

/// Runs --compare. Returns the exit code.
int compare_estimators(const EstimationOptions& options);

}  // namespace photocoag
