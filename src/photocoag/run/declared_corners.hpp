// Role: setup; which corners of the declared set the margin's search has to visit. Used by
// run/tissue_margin. Source: derived here; docs/control.md (declared uncertainty). Units: SI.
#pragma once

#include <cstddef>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/declared_eye.hpp"

namespace photocoag {

/// All combinations of signs of the quantities that change the peak of a noise-free treatment by
/// 0.1 % of the limit or more at one of `alphas` (seven at most, the most important ones); of the
/// others the signs that raise the peak by themselves, once those of the first period and once
/// those of the last. `cells`, `periods`: of the treatments. Throws Error. Allocates.
std::vector<std::vector<int>> declared_corners(const Config& config, const ReducedModel& model,
                                               const std::vector<DeclaredQuantity>& quantities,
                                               const std::vector<double>& alphas, std::size_t cells,
                                               std::size_t periods);

}  // namespace photocoag
