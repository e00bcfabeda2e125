// Role: safety tests; reduced model files that must be refused before any device is opened (row
// F1), made from a good one. Used by fault_table, tests. Source: docs/safety.md.
#pragma once

#include <string>
#include <vector>

#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct BadModel {
  std::string what;
  std::string text;  ///< of the file
};

/// Truncated, altered, of another version, with wrong dimensions, unphysical.
std::vector<BadModel> bad_models(const ReducedModel& good);

}  // namespace photocoag
