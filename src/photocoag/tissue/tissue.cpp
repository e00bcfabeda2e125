#include "photocoag/tissue/tissue.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <set>

#include "photocoag/core/check.hpp"
#include "photocoag/core/setting.hpp"

namespace photocoag {

namespace {
constexpr std::array<std::string_view, kMaxParameters + 1> kScaledBy = {"none", "alpha", "beta"};
}  // namespace

std::string_view to_string(ScaledBy value) noexcept {
  return kScaledBy[static_cast<std::size_t>(value)];
}

std::string_view to_string(VolumeTemperature value) noexcept {
  return value == VolumeTemperature::kAbsorptionWeighted ? "absorption-weighted" : "normalized";
}

std::string_view to_string(BeamProfile value) noexcept {
  constexpr std::string_view names[] = {"flat-top", "gaussian", "table"};
  return names[static_cast<std::size_t>(value)];
}

ThermalData Tissue::thermal(const Layer& layer) const noexcept {
  return {.conductivity = layer.conductivity.value_or(conductivity),
          .volumetric_heat_capacity =
              layer.density.value_or(density) * layer.heat_capacity.value_or(heat_capacity),
          .perfusion = layer.perfusion};
}

bool Tissue::two_parameters() const noexcept {
  return std::any_of(layers.begin(), layers.end(), [](const Layer& layer) {
    return layer.scaled_by == ScaledBy::kBeta && layer.absorption > 0.0;
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

// W/(m K), below any material: without conduction there is no reduced model.
constexpr double kLeastConductivity = 1e-3;

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
    light = light || values[i] > 0.0;
  }
  require(!table || light, key("beam_intensity"), std::string_view("no light"),
          "at least one number above 0");
}

}  // namespace

std::vector<Field> fields_of(Tissue& t, std::string_view prefix) {
  using namespace units;
  FieldTable table(prefix);
  table.number("ambient_C", t.ambient_celsius, {"deg C"}, {-10, 60},
               "absolute temperature = ambient + rise");
  table.number("domain_radius_um", t.domain_radius, kMicrometres, {1, 20000},
               "no temperature rise there; 2 to 2000 times spot_radius_um");
  table.number("spot_radius_um", t.spot_radius, kMicrometres, {0.01, 5000},
               "of the flat top; where the Gaussian has 1/e2 of its intensity");
  table.word("beam", t.beam,
             {to_string(BeamProfile::kFlatTop), to_string(BeamProfile::kGaussian),
              to_string(BeamProfile::kTable)},
             "the beam's profile, and the weight over the radius of the volume temperature");
  table.numbers("beam_radius_um", t.beam_radii, kMicrometres, {0, 20000},
                "ascending, up to domain_radius_um; of the table, else empty");
  table.numbers("beam_intensity", t.beam_intensities, kOne, {0, 1e6},
                "relative, one per radius; linear between them, 0 beyond the last");
  table.number("transmission", t.transmission, kOne, {0, 1, true},
               "power at the fundus / commanded power");
  table.number("density_kg_per_m3", t.density, {"kg/m3"}, {1, 1e5}, "of the tissue");
  table.number("heat_capacity_J_per_kgK", t.heat_capacity, {"J/(kg K)"}, {1, 1e5},
               "specific, of the tissue");
  table.number("conductivity_W_per_mK", t.conductivity, {"W/(m K)"}, {kLeastConductivity, 1e3},
               "thermal, of the tissue");
  table.word("volume_temperature", t.volume_temperature,
             {to_string(VolumeTemperature::kAbsorptionWeighted),
              to_string(VolumeTemperature::kNormalized)},
             "the paper's C_vol, or the same divided by the absorbed fraction");
  table.text("peak_layer", t.peak_layer,
             "the name of a layer: the peak temperature is at its mid-depth");
  table.add(
      "layers", LayersField{&t.layers},
      "1 to 32, in the order in which the light meets them; thickness 0.01 to 20000 "
      "um;\nabsorption 0 to 1e7 1/m, times alpha or beta where scaled_by = \"alpha\" or "
      "\"beta\".\nOptional: conductivity_W_per_mK, density_kg_per_m3, heat_capacity_J_per_kgK "
      "(else the "
      "tissue's), "
      "perfusion_W_per_m3K (else 0; 0 to 1e8)");
  return table.take();
}

std::vector<Field> layer_fields(Layer& layer, std::string_view prefix) {
  using namespace units;
  FieldTable table(prefix);
  table.text("name", layer.name, "unique");
  table.number("thickness_um", layer.thickness, kMicrometres, {0.01, 20000}, "thickness");
  table.number("absorption_per_m", layer.absorption, {"1/m"}, {0, 1e7}, "absorption coefficient");
  table.add("scaled_by",
            WordField{{kScaledBy.begin(), kScaledBy.end()},
                      [&layer] { return static_cast<std::size_t>(layer.scaled_by); },
                      [&layer](std::size_t index) { layer.scaled_by = ScaledBy(index); },
                      {}},
            "alpha, beta: multiplied by it");
  table.optional_number("conductivity_W_per_mK", layer.conductivity, {"W/(m K)"},
                        {kLeastConductivity, 1e3}, "thermal; else the tissue's");
  table.optional_number("density_kg_per_m3", layer.density, {"kg/m3"}, {1, 1e5},
                        "else the tissue's");
  table.optional_number("heat_capacity_J_per_kgK", layer.heat_capacity, {"J/(kg K)"}, {1, 1e5},
                        "specific; else the tissue's");
  table.number("perfusion_W_per_m3K", layer.perfusion, {"W/(m3 K)"}, {0, 1e8},
               "heat carried away by blood at ambient");
  return table.take();
}

void Tissue::validate(std::string_view prefix) const {
  const auto key = [prefix](std::string_view name) { return fmt::format("{}.{}", prefix, name); };
  Tissue own = *this;
  require_in_range(fields_of(own, prefix));
  require(domain_radius >= 2.0 * spot_radius, key("domain_radius_um"), domain_radius * 1e6,
          fmt::format("at least twice {} = {} um", key("spot_radius_um"), spot_radius * 1e6));
  // The grid resolves the spot: beyond this it would have too many cells.
  constexpr double kMostSpots = 2000.0;
  require(domain_radius <= kMostSpots * spot_radius, key("domain_radius_um"), domain_radius * 1e6,
          fmt::format("at most {} times {} = {} um", kMostSpots, key("spot_radius_um"),
                      spot_radius * 1e6));
  validate_beam(*this, prefix);
  require(!layers.empty() && layers.size() <= 32, key("layers"), std::to_string(layers.size()),
          "1 to 32 layers");
  std::set<std::string> names;
  bool scaled = false;
  for (Layer& layer : own.layers) {
    const std::string name = fmt::format("{}.layers.{}", prefix, layer.name);
    require(!layer.name.empty(), key("layers"), std::string_view("a layer without a name"),
            "a name for every layer");
    require(names.insert(layer.name).second, key("layers"), layer.name, "each name once");
    require_in_range(layer_fields(layer, name));
    scaled = scaled || (layer.scaled_by == ScaledBy::kAlpha && layer.absorption > 0.0);
  }
  require(scaled, key("layers"), std::string_view("no absorbing layer with scaled_by = \"alpha\""),
          "at least one layer with scaled_by = \"alpha\" and absorption_per_m above 0");
  const bool known = std::any_of(layers.begin(), layers.end(),
                                 [this](const Layer& layer) { return layer.name == peak_layer; });
  require(known, key("peak_layer"), peak_layer, "the name of one of " + key("layers"));
}

}  // namespace photocoag
