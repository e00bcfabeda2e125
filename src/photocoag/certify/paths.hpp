// Role: offline; enumerates the sequences of decisions that DenseSolver may take in a box of
// parameters, and finds the longest. Used by certify. Source: docs/certify.md. Units: none. Real
// time: none. Threads: one owner.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "photocoag/certify/cell_problem.hpp"

namespace photocoag {

struct PathSearch {
  /// No problem of the cell needs more changes of the active set; meaningless unless `complete`.
  int longest = 0;
  long long nodes = 0;     ///< decisions that could not be excluded
  bool complete = false;   ///< false: the budget was used up, or something stayed undecided
  double condition = 0.0;  ///< of the Hessian, at most
};

/// Callback with a point (x, t) in or near the region of a path, and its number of changes.
using Witness = std::function<void(const std::array<double, kMaxDimensions>& point, int changes)>;

/// `budget`: most nodes. `enough`: the search stops, incomplete, once a path is longer. `witness`
/// gets a point of every path that is longer than all before.
PathSearch search_paths(CellProblem& problem, long long budget, int enough, const Witness& witness);

}  // namespace photocoag
