// Role: offline; checks that the domain is large enough. Used by `photocoag boundaries`. Source:
// the paper assumes it (section 2: "chosen large enough"); docs/equations.md, deviation 15. Units:
// SI.
#pragma once

#include <string>
#include <vector>

#include "photocoag/fom/grid_settings.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// How the peak gain (K per W of constant power) reacts when one boundary moves out.
struct BoundaryEffect {
  std::string boundary;        ///< "front", "back" or "radius"
  std::string moved;           ///< how it was moved, as text
  std::vector<double> change;  ///< relative change of the peak gain, one per time
};

/// Moves each boundary (zero temperature rise) out in turn: 2 mm of clear tissue in front of the
/// first layer, 2 mm more of the last layer's thermal data behind it, twice the radius; compares
/// the full-order peak after constant power at `times`, s (ascending, above 0). Throws Error on a
/// bad tissue. Allocates: four full-order models.
std::vector<BoundaryEffect> boundary_effects(const Tissue& tissue, const GridSettings& grid,
                                             AbsorptionFactors absorption,
                                             const std::vector<double>& times);

}  // namespace photocoag
