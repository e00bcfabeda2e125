// Any bytes as a reduced model file: refused with an Error, or a model that is written and read
// again as the same. With its checksum made to fit as well, so that what is behind it is reached.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "photocoag/core/error.hpp"
#include "photocoag/rom/file.hpp"
#include "support/reduced_models.hpp"

namespace {

void read(std::string_view text) {
  try {
    const std::string written = photocoag::to_json(photocoag::from_json(text, "fuzz"));
    if (photocoag::to_json(photocoag::from_json(written, "fuzz")) != written) std::abort();
  } catch (const photocoag::Error&) {
    // Refused, as it should be.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using photocoag::testing::Json;
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  read(text);
  // Deep nesting would cost this program's own copy its stack, and is tested in tests/rom.
  constexpr std::size_t kMostBrackets = 5000;
  if (std::count(text.begin(), text.end(), '[') > static_cast<long>(kMostBrackets)) return 0;
  if (std::count(text.begin(), text.end(), '{') > static_cast<long>(kMostBrackets)) return 0;
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return 0;
  try {
    read(photocoag::testing::sealed(json));
  } catch (const Json::exception&) {
    // No UTF-8: cannot be written.
  }
  return 0;
}
