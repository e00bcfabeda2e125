// Role: setup; how fine the full-order model's grid is. Used by fom and the configuration.
#pragma once

#include <cstddef>
#include <vector>

namespace photocoag {

struct Field;  // core/setting.hpp

struct GridSettings {
  std::size_t min_cells = 80000;  ///< n, radial times axial cells, 1,000 to 1,000,000; the grid has
                                  ///< at least so many. The paper: more than 80,000

  /// Throws Error naming "grid.min_cells".
  void validate() const;
  bool operator==(const GridSettings&) const = default;
};

/// The key "grid.min_cells", bound to `settings`.
std::vector<Field> fields_of(GridSettings& settings);

}  // namespace photocoag
