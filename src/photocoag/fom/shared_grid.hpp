// Role: offline; one grid for many tissues. Used by mor (uncertain model) and campaign. Source:
// ours. Layer boundaries and the spot's edge move over it; sources are integrated over its cells,
// so that no spot needs a diagonalisation of its own. Units: m.
#pragma once

#include "photocoag/fom/grid.hpp"

namespace photocoag {

/// Ranges of the layer boundaries and spot radii of a campaign, m.
struct BoundaryRange {
  double peak_front = 0.0;  ///< least depth of the peak layer's front
  double peak_back = 0.0;   ///< greatest depth of its back
  double depth = 0.0;     ///< total, the same for all spots: the last layer absorbs the differences
  double spot_low = 0.0;  ///< spot radius
  double spot_high = 0.0;
  double domain_radius = 0.0;
};

/// At least `min_cells` cells, fine wherever a source may have an edge. Step responses are within
/// 0.2 % of those on a grid fitted to the spot (SharedGrid.IsWithinTwoPerMilleOfAFittedOne).
Grid make_shared_grid(const BoundaryRange& range, std::size_t min_cells);

}  // namespace photocoag
