#include "photocoag/core/build_info.hpp"

#include "photocoag/core/build_info_generated.hpp"

namespace photocoag {

std::string_view version() noexcept { return PHOTOCOAG_VERSION; }
std::string_view source_hash() noexcept { return PHOTOCOAG_SOURCE_HASH; }

}  // namespace photocoag
