#include "photocoag/fom/grid_settings.hpp"

#include "photocoag/core/setting.hpp"

namespace photocoag {

std::vector<Field> fields_of(GridSettings& settings) {
  FieldTable table("grid");
  table.integer("min_cells", settings.min_cells, 1000, 1'000'000,
                "smallest number of cells; the paper: more than 80000");
  return table.take();
}

void GridSettings::validate() const {
  GridSettings own = *this;
  require_in_range(fields_of(own));
}

}  // namespace photocoag
