#include "photocoag/run/boundaries.hpp"

#include <fmt/format.h>

#include <memory>

#include "photocoag/core/step_response.hpp"
#include "photocoag/fom/stepper.hpp"

namespace photocoag {
namespace {

constexpr double kMoved = 2e-3;  // m

std::vector<Outputs> unit_response(const Tissue& tissue, const GridSettings& grid,
                                   AbsorptionFactors at, const std::vector<double>& times) {
  FullOrderPlant plant(std::make_shared<const FullOrderModel>(tissue, grid),
                       Discretization::kZeroOrderHold, times.front(), at, 0.0);
  return sample_step_response(plant, Discretization::kZeroOrderHold, times.front(), 1.0, times);
}

// A layer of its own beyond `neighbour`, so that the larger domain does not absorb more light.
Layer clear_layer(const std::string& where, const Layer& neighbour) {
  Layer layer = neighbour;
  layer.name = where + neighbour.name;
  layer.thickness = kMoved;
  layer.absorption = 0.0;
  layer.scaled_by = ScaledBy::kNothing;
  return layer;
}

}  // namespace

std::vector<BoundaryEffect> boundary_effects(const Tissue& tissue, const GridSettings& grid,
                                             AbsorptionFactors absorption,
                                             const std::vector<double>& times) {
  Tissue front = tissue;
  front.layers.insert(front.layers.begin(), clear_layer("in front of ", tissue.layers.front()));
  Tissue back = tissue;
  back.layers.push_back(clear_layer("behind ", tissue.layers.back()));
  Tissue radius = tissue;
  radius.domain_radius *= 2.0;

  const std::vector<Outputs> base = unit_response(tissue, grid, absorption, times);
  std::vector<BoundaryEffect> effects;
  const auto compare = [&](std::string name, std::string moved, const Tissue& larger) {
    const std::vector<Outputs> moved_out = unit_response(larger, grid, absorption, times);
    BoundaryEffect effect{std::move(name), std::move(moved), {}};
    for (std::size_t i = 0; i < times.size(); ++i) {
      effect.change.push_back(moved_out[i].peak / base[i].peak - 1.0);
    }
    effects.push_back(std::move(effect));
  };
  compare("front", fmt::format("{:g} mm of clear tissue added", kMoved * 1e3), front);
  compare("back", fmt::format("{:g} mm of clear tissue added", kMoved * 1e3), back);
  compare("radius",
          fmt::format("{:g} to {:g} mm", tissue.domain_radius * 1e3, radius.domain_radius * 1e3),
          radius);
  return effects;
}

}  // namespace photocoag
