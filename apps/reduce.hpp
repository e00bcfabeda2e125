// Role: the program; declarations shared by the two files of `reduce`.
#pragma once

#include <string>

#include "options.hpp"

namespace photocoag {

struct ReduceOptions : CommonOptions {
  std::string out;  ///< model file; with compare: a folder or a .csv file, may be empty
  bool compare = false;
  std::string method;
  std::string order;
  bool json = false;  ///< sizes and errors as JSON on standard output
};

/// Runs --compare. Returns the exit code.
int compare_reductions(const ReduceOptions& options);

}  // namespace photocoag
