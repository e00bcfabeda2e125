// Role: setup; the C files of src/export/c as they are in the source tree, embedded when photocoag
// is built (cmake/embed_c.cmake). Used by export.
#pragma once

#include <string_view>
#include <vector>

namespace photocoag {

struct CSource {
  std::string_view name;  ///< pc_model.h.in, pc_controller.c, …
  std::string_view text;  ///< with the prefix pc_ and placeholders @name@
};

/// In the order of their names.
const std::vector<CSource>& c_sources();

}  // namespace photocoag
