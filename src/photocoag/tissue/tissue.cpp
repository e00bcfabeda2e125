#include "photocoag/tissue/tissue.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <set>

#include "photocoag/core/check.hpp"

namespace photocoag {

std::string_view to_string(VolumeTemperature value) noexcept {
  return value == VolumeTemperature::kAbsorptionWeighted ? "absorption-weighted" : "normalized";
}

double Tissue::depth() const noexcept {
  double sum = 0.0;
  for (const Layer& layer : layers) sum += layer.thickness;
  return sum;
}

double Tissue::peak_depth() const {
  double front = 0.0;
  for (const Layer& layer : layers) {
    if (layer.name == peak_layer) return front + 0.5 * layer.thickness;
    front += layer.thickness;
  }
  std::string names;
  for (const Layer& layer : layers) names += (names.empty() ? "" : ", ") + layer.name;
  require(false, "tissue.peak_layer", peak_layer, "the name of a layer: " + names);
  return 0.0;
}

void Tissue::validate(std::string_view prefix) const {
  const auto key = [prefix](std::string_view name) { return fmt::format("{}.{}", prefix, name); };
  // Lengths are checked in micrometres, as they stand in the configuration.
  require_between(ambient_celsius, -10.0, 60.0, key("ambient_C"));
  require_positive(spot_radius * 1e6, 5000.0, key("spot_radius_um"));
  require_between(domain_radius * 1e6, 1.0, 20000.0, key("domain_radius_um"));
  require(domain_radius >= 2.0 * spot_radius, key("domain_radius_um"), domain_radius * 1e6,
          fmt::format("at least twice {} = {} um", key("spot_radius_um"), spot_radius * 1e6));
  require_positive(transmission, 1.0, key("transmission"));
  require_positive(density, 1e5, key("density_kg_per_m3"));
  require_positive(heat_capacity, 1e5, key("heat_capacity_J_per_kgK"));
  require_positive(conductivity, 1e3, key("conductivity_W_per_mK"));
  require(!layers.empty() && layers.size() <= 32, key("layers"), std::to_string(layers.size()),
          "1 to 32 layers");
  std::set<std::string> names;
  bool scaled = false;
  for (const Layer& layer : layers) {
    const std::string name = fmt::format("{}.layers.{}", prefix, layer.name);
    require(!layer.name.empty(), key("layers"), std::string_view("a layer without a name"),
            "a name for every layer");
    require(names.insert(layer.name).second, key("layers"), layer.name, "each name once");
    require_positive(layer.thickness * 1e6, 20000.0, name + ".thickness_um");
    require_between(layer.absorption, 0.0, 1e7, name + ".absorption_per_m");
    scaled = scaled || (layer.scaled_by_alpha && layer.absorption > 0.0);
  }
  require(scaled, key("layers"), std::string_view("no absorbing layer with scaled_by = \"alpha\""),
          "at least one layer with scaled_by = \"alpha\" and absorption_per_m above 0");
  const bool known = std::any_of(layers.begin(), layers.end(),
                                 [this](const Layer& layer) { return layer.name == peak_layer; });
  require(known, key("peak_layer"), peak_layer, "the name of one of " + key("layers"));
}

}  // namespace photocoag
