// Role: setup; selects the corners of the declared set that the margin's search visits. Used by
// run/tissue_margin. Source: derived here; docs/control.md (declared uncertainty). Units: SI.
#pragma once

#include <cstddef>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/declared_eye.hpp"

namespace photocoag {

/// All sign combinations of the quantities (the most important ones, at most seven) that change the
/// peak of a noise-free treatment by at least 0.1 % of the limit at one of `alphas`; the others get
/// the sign that raises the peak, once in the first and once in the last period. `cells`,
/// `periods`: of the treatments. Throws Error. Allocates.
std::vector<std::vector<int>> declared_corners(const Config& config, const ReducedModel& model,
                                               const std::vector<DeclaredQuantity>& quantities,
                                               const std::vector<double>& alphas, std::size_t cells,
                                               std::size_t periods);

}  // namespace photocoag
