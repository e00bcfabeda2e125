#include "photocoag/config/prior.hpp"

namespace photocoag {

const RandomQuantity* Prior::find(std::string_view key) const noexcept {
  for (const RandomQuantity& quantity : quantities) {
    if (quantity.key == key) return &quantity;
  }
  return nullptr;
}

}  // namespace photocoag
