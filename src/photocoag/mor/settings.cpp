#include "photocoag/mor/settings.hpp"

#include "photocoag/core/check.hpp"

namespace photocoag {

void ReductionSettings::validate() const {
  require(order >= 1 && order <= 14, "model.order", order, "an integer from 1 to 14");
}

}  // namespace photocoag
