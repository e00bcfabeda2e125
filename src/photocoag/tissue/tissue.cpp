#include "photocoag/tissue/tissue.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <set>

#include "photocoag/core/check.hpp"

namespace photocoag {

std::string_view to_string(VolumeTemperature value) noexcept {
  return value == VolumeTemperature::kAbsorptionWeighted ? "absorption-weighted" : "normalized";
}

std::string_view to_string(BeamProfile value) noexcept {
  switch (value) {
    case BeamProfile::kFlatTop:
      return "flat-top";
    case BeamProfile::kGaussian:
      return "gaussian";
    case BeamProfile::kTable:
      return "table";
  }
  return "";
}

ThermalData Tissue::thermal(const Layer& layer) const noexcept {
  return {.conductivity = layer.conductivity.value_or(conductivity),
          .volumetric_heat_capacity =
              layer.density.value_or(density) * layer.heat_capacity.value_or(heat_capacity),
          .perfusion = layer.perfusion};
}

bool Tissue::two_parameters() const noexcept {
  return std::any_of(layers.begin(), layers.end(), [](const Layer& layer) {
    return layer.scaled_by_beta && layer.absorption > 0.0;
  });
}

bool Tissue::uniform_conduction() const noexcept {
  return std::all_of(layers.begin(), layers.end(), [this](const Layer& layer) {
    const ThermalData first = thermal(layers.front());
    const ThermalData own = thermal(layer);
    return own.conductivity == first.conductivity &&
           own.volumetric_heat_capacity == first.volumetric_heat_capacity;
  });
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

namespace {

// W/(m K), below any matter: heat that does not spread has no reduced model.
constexpr double kLeastConductivity = 1e-3;

void validate_thermal(const Layer& layer, const std::string& name) {
  if (layer.conductivity)
    require_between(*layer.conductivity, kLeastConductivity, 1e3, name + ".conductivity_W_per_mK");
  if (layer.density) require_between(*layer.density, 1.0, 1e5, name + ".density_kg_per_m3");
  if (layer.heat_capacity) {
    require_between(*layer.heat_capacity, 1.0, 1e5, name + ".heat_capacity_J_per_kgK");
  }
  require_between(layer.perfusion, 0.0, 1e8, name + ".perfusion_W_per_m3K");
}

void validate_beam(const Tissue& tissue, std::string_view prefix) {
  const auto key = [prefix](std::string_view name) { return fmt::format("{}.{}", prefix, name); };
  const std::vector<double>& radii = tissue.beam_radii;
  const std::vector<double>& values = tissue.beam_intensities;
  const auto count = [](const std::vector<double>& list) {
    return fmt::format("{} numbers", list.size());
  };
  const bool table = tissue.beam == BeamProfile::kTable;
  require(table ? radii.size() >= 2 && radii.size() <= kMaxBeamEntries : radii.empty(),
          key("beam_radius_um"), count(radii),
          table ? fmt::format("2 to {} radii for {} = \"table\"", kMaxBeamEntries, key("beam"))
                : fmt::format("radii for {} = \"table\" only", key("beam")));
  require(values.size() == radii.size(), key("beam_intensity"), count(values),
          fmt::format("as many as in {}: {}", key("beam_radius_um"), radii.size()));
  bool light = false;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const double before = i == 0 ? 0.0 : radii[i - 1];
    const bool ascending = i == 0 ? radii[i] >= 0.0 : radii[i] > before;
    require(ascending && radii[i] <= tissue.domain_radius, key("beam_radius_um"), radii[i] * 1e6,
            fmt::format("ascending radii from 0 to {} = {} um", key("domain_radius_um"),
                        tissue.domain_radius * 1e6));
    require(values[i] >= 0.0 && values[i] <= 1e6, key("beam_intensity"), values[i],
            "numbers from 0 to 1e6");
    light = light || values[i] > 0.0;
  }
  require(!table || light, key("beam_intensity"), std::string_view("no light"),
          "at least one number above 0");
}

}  // namespace

void Tissue::validate(std::string_view prefix) const {
  const auto key = [prefix](std::string_view name) { return fmt::format("{}.{}", prefix, name); };
  // Lengths are checked in micrometres, as they stand in the configuration.
  require_between(ambient_celsius, -10.0, 60.0, key("ambient_C"));
  require_between(spot_radius * 1e6, 0.01, 5000.0, key("spot_radius_um"));
  require_between(domain_radius * 1e6, 1.0, 20000.0, key("domain_radius_um"));
  require(domain_radius >= 2.0 * spot_radius, key("domain_radius_um"), domain_radius * 1e6,
          fmt::format("at least twice {} = {} um", key("spot_radius_um"), spot_radius * 1e6));
  // The grid resolves the spot: beyond this it would have too many cells.
  constexpr double kMostSpots = 2000.0;
  require(domain_radius <= kMostSpots * spot_radius, key("domain_radius_um"), domain_radius * 1e6,
          fmt::format("at most {} times {} = {} um", kMostSpots, key("spot_radius_um"),
                      spot_radius * 1e6));
  validate_beam(*this, prefix);
  require_positive(transmission, 1.0, key("transmission"));
  require_between(density, 1.0, 1e5, key("density_kg_per_m3"));
  require_between(heat_capacity, 1.0, 1e5, key("heat_capacity_J_per_kgK"));
  require_between(conductivity, kLeastConductivity, 1e3, key("conductivity_W_per_mK"));
  require(!layers.empty() && layers.size() <= 32, key("layers"), std::to_string(layers.size()),
          "1 to 32 layers");
  std::set<std::string> names;
  bool scaled = false;
  for (const Layer& layer : layers) {
    const std::string name = fmt::format("{}.layers.{}", prefix, layer.name);
    require(!layer.name.empty(), key("layers"), std::string_view("a layer without a name"),
            "a name for every layer");
    require(names.insert(layer.name).second, key("layers"), layer.name, "each name once");
    require_between(layer.thickness * 1e6, 0.01, 20000.0, name + ".thickness_um");
    require_between(layer.absorption, 0.0, 1e7, name + ".absorption_per_m");
    validate_thermal(layer, name);
    require(!(layer.scaled_by_alpha && layer.scaled_by_beta), name + ".scaled_by",
            std::string_view("both"), "alpha or beta, not both");
    scaled = scaled || (layer.scaled_by_alpha && layer.absorption > 0.0);
  }
  require(scaled, key("layers"), std::string_view("no absorbing layer with scaled_by = \"alpha\""),
          "at least one layer with scaled_by = \"alpha\" and absorption_per_m above 0");
  const bool known = std::any_of(layers.begin(), layers.end(),
                                 [this](const Layer& layer) { return layer.name == peak_layer; });
  require(known, key("peak_layer"), peak_layer, "the name of one of " + key("layers"));
}

}  // namespace photocoag
