#include "photocoag/tissue/tissue.hpp"
#include "photocoag/core/types.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::thrown_by;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void table(Tissue& tissue, std::vector<double> radii, std::vector<double> intensities) {
  tissue.beam = BeamProfile::kTable;
  tissue.beam_radii = std::move(radii);
  tissue.beam_intensities = std::move(intensities);
}

struct BadTissue {
  const char* key;
  std::function<void(Tissue&)> spoil;
};

TEST(Tissue, DefaultsAreThePapers) {
  const Tissue tissue;
  EXPECT_NO_THROW(tissue.validate());
  EXPECT_NEAR(tissue.diffusivity(), 1.512e-7, 1e-10);  // domain data, four digits
  EXPECT_NEAR(tissue.depth(), 1300e-6, 1e-15);
  EXPECT_NEAR(tissue.peak_depth(), 193e-6, 1e-15);
}

TEST(Tissue, EveryBadValueIsNamed) {
  const std::vector<BadTissue> cases = {
      {"ambient_C", [](Tissue& t) { t.ambient_celsius = 61.0; }},
      {"ambient_C", [](Tissue& t) { t.ambient_celsius = -11.0; }},
      {"ambient_C", [](Tissue& t) { t.ambient_celsius = kNan; }},
      {"spot_radius_um", [](Tissue& t) { t.spot_radius = 0.0; }},
      {"spot_radius_um", [](Tissue& t) { t.spot_radius = -1e-4; }},
      {"spot_radius_um", [](Tissue& t) { t.spot_radius = kNan; }},
      {"spot_radius_um", [](Tissue& t) { t.spot_radius = 100.0; }},  // um taken for m
      {"domain_radius_um", [](Tissue& t) { t.domain_radius = 150e-6; }},
      {"domain_radius_um", [](Tissue& t) { t.domain_radius = kInfinity; }},
      {"domain_radius_um", [](Tissue& t) { t.domain_radius = 0.03; }},
      {"transmission", [](Tissue& t) { t.transmission = 0.0; }},
      {"transmission", [](Tissue& t) { t.transmission = 1.01; }},
      {"density_kg_per_m3", [](Tissue& t) { t.density = 0.0; }},
      {"density_kg_per_m3", [](Tissue& t) { t.density = kInfinity; }},
      {"heat_capacity_J_per_kgK", [](Tissue& t) { t.heat_capacity = -4176.0; }},
      {"conductivity_W_per_mK", [](Tissue& t) { t.conductivity = 0.0; }},
      {"conductivity_W_per_mK", [](Tissue& t) { t.conductivity = kNan; }},
      {"layers", [](Tissue& t) { t.layers.clear(); }},
      {"layers",
       [](Tissue& t) {
         t.layers.resize(33, {"x", 1e-6, 1.0});
       }},
      {"layers", [](Tissue& t) { t.layers[0].name.clear(); }},
      {"layers", [](Tissue& t) { t.layers[0].name = "sclera"; }},
      {"layers", [](Tissue& t) { t.layers[1].scaled_by = ScaledBy::kNothing; }},
      {"layers", [](Tissue& t) { t.layers[1].absorption = 0.0; }},
      {"layers.RPE.thickness_um", [](Tissue& t) { t.layers[1].thickness = 0.0; }},
      {"layers.RPE.thickness_um", [](Tissue& t) { t.layers[1].thickness = 6.0; }},
      {"layers.choroid.thickness_um", [](Tissue& t) { t.layers[3].thickness = kNan; }},
      {"layers.choroid.absorption_per_m", [](Tissue& t) { t.layers[3].absorption = -1.0; }},
      {"layers.choroid.absorption_per_m", [](Tissue& t) { t.layers[3].absorption = 2e7; }},
      {"layers.RPE.absorption_per_m", [](Tissue& t) { t.layers[1].absorption = kNan; }},
      {"layers.RPE.conductivity_W_per_mK", [](Tissue& t) { t.layers[1].conductivity = 0.0; }},
      {"layers.RPE.density_kg_per_m3", [](Tissue& t) { t.layers[1].density = kNan; }},
      {"layers.RPE.heat_capacity_J_per_kgK", [](Tissue& t) { t.layers[1].heat_capacity = -1.0; }},
      {"layers.choroid.perfusion_W_per_m3K", [](Tissue& t) { t.layers[3].perfusion = -1.0; }},
      {"layers.choroid.perfusion_W_per_m3K", [](Tissue& t) { t.layers[3].perfusion = 2e8; }},
      {"beam_radius_um", [](Tissue& t) { t.beam = BeamProfile::kTable; }},
      {"beam_radius_um",
       [](Tissue& t) {
         t.beam_radii = {0.0, 1e-4};
       }},  // of a flat top
      {"beam_radius_um",
       [](Tissue& t) {
         table(t, {0.0, 0.0}, {1.0, 1.0});
       }},
      {"beam_radius_um",
       [](Tissue& t) {
         table(t, {1e-4, 5e-5}, {1.0, 1.0});
       }},
      {"beam_radius_um",
       [](Tissue& t) {
         table(t, {-1e-4, 5e-5}, {1.0, 1.0});
       }},
      {"beam_radius_um",
       [](Tissue& t) {
         table(t, {0.0, 100.0}, {1.0, 1.0});
       }},  // um taken for m
      {"beam_radius_um",
       [](Tissue& t) {
         table(t, {0.0, kNan}, {1.0, 1.0});
       }},
      {"beam_intensity",
       [](Tissue& t) {
         table(t, {0.0, 1e-4}, {1.0});
       }},
      {"beam_intensity",
       [](Tissue& t) {
         table(t, {0.0, 1e-4}, {0.0, 0.0});
       }},
      {"beam_intensity",
       [](Tissue& t) {
         table(t, {0.0, 1e-4}, {1.0, -1.0});
       }},
      {"beam_intensity",
       [](Tissue& t) {
         table(t, {0.0, 1e-4}, {1.0, kNan});
       }},
      {"peak_layer", [](Tissue& t) { t.peak_layer = "rpe"; }},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Tissue tissue;
    cases[i].spoil(tissue);
    const ErrorParts parts = thrown_by([&] { tissue.validate("plant.tissue"); });
    EXPECT_EQ(parts.key, std::string("plant.tissue.") + cases[i].key) << "case " << i;
    EXPECT_FALSE(parts.found.empty()) << "case " << i;
    EXPECT_FALSE(parts.accepted.empty()) << "case " << i;
  }
}

TEST(Tissue, PeakDepthFollowsTheNamedLayer) {
  Tissue tissue;
  tissue.peak_layer = "choroid";
  EXPECT_NEAR(tissue.peak_depth(), 400e-6, 1e-15);
  tissue.peak_layer = "lens";
  const ErrorParts parts = thrown_by([&] { tissue.peak_depth(); });
  EXPECT_EQ(parts.found, "lens");
  EXPECT_NE(parts.accepted.find("retina, RPE, unpigmented, choroid, sclera"), std::string::npos);
}

TEST(Tissue, LimitsThemselvesAreAccepted) {
  Tissue tissue;
  tissue.domain_radius = 2.0 * tissue.spot_radius;
  tissue.transmission = 1.0;
  tissue.ambient_celsius = 60.0;
  tissue.layers[3].absorption = 1e7;
  tissue.layers[4].thickness = 0.02;
  EXPECT_NO_THROW(tissue.validate());
}

}  // namespace
}  // namespace photocoag
