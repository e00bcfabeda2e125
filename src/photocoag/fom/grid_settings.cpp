#include "photocoag/fom/grid_settings.hpp"

#include "photocoag/core/check.hpp"

namespace photocoag {

void GridSettings::validate() const {
  require(min_cells >= 1000 && min_cells <= 1000000, "grid.min_cells",
          static_cast<double>(min_cells), "an integer from 1000 to 1000000");
}

}  // namespace photocoag
