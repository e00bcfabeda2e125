// Role: tests; tissues that differ from the default in what could go wrong.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "photocoag/tissue/tissue.hpp"

namespace photocoag::testing {

inline Tissue literature_choroid() {
  Tissue tissue;
  tissue.layers[3].absorption = 26622.0;
  return tissue;
}

/// The choroid's absorption times beta: two parameters.
inline Tissue with_beta(Tissue tissue = {}) {
  for (Layer& layer : tissue.layers) {
    if (layer.name == "choroid") layer.scaled_by = ScaledBy::kBeta;
  }
  return tissue;
}

/// 2 mm of vitreous in front, a thick sclera behind.
inline Tissue with_vitreous() {
  Tissue tissue;
  tissue.layers[4].thickness = 2000e-6;
  tissue.layers.insert(tissue.layers.begin(), Layer{"vitreous", 2000e-6, 0.0});
  return tissue;
}

inline Tissue normalized(Tissue tissue) {
  tissue.volume_temperature = VolumeTemperature::kNormalized;
  return tissue;
}

/// Every layer with thermal data of its own; fat-like sclera, blood in the choroid.
inline Tissue layered() {
  Tissue tissue;
  tissue.layers[0].conductivity = 0.565;
  tissue.layers[1].conductivity = 0.8;
  tissue.layers[1].density = 1100.0;
  tissue.layers[2].heat_capacity = 3500.0;
  tissue.layers[3].conductivity = 0.53;
  tissue.layers[3].density = 1050.0;
  tissue.layers[3].heat_capacity = 3840.0;
  tissue.layers[3].perfusion = 1e5;
  tissue.layers[4].conductivity = 0.3;
  tissue.layers[4].heat_capacity = 3000.0;
  return tissue;
}

/// The same heat flow as in `tissue`, but no longer exactly uniform: takes the general path.
inline Tissue barely_layered(Tissue tissue) {
  tissue.layers[0].conductivity = std::nextafter(tissue.conductivity, 1.0);
  return tissue;
}

inline Tissue gaussian(Tissue tissue) {
  tissue.beam = BeamProfile::kGaussian;
  return tissue;
}

/// A ring: dark on the axis.
inline Tissue ring_beam(Tissue tissue) {
  tissue.beam = BeamProfile::kTable;
  tissue.beam_radii = {10e-6, 60e-6, 90e-6, 140e-6};
  tissue.beam_intensities = {0.2, 1.0, 0.7, 0.0};
  return tissue;
}

inline std::vector<std::pair<std::string, Tissue>> various_tissues() {
  Tissue thin;
  thin.layers[1].thickness = 0.5e-6;
  Tissue small_spot = with_vitreous();
  small_spot.spot_radius = 25e-6;
  small_spot.domain_radius = 5e-3;
  Tissue narrow;
  narrow.domain_radius = 2.0 * narrow.spot_radius;
  Tissue single;
  single.layers = {{"RPE", 300e-6, 5000.0, ScaledBy::kAlpha}};
  Tissue deep_peak;
  deep_peak.peak_layer = "choroid";
  return {{"default", Tissue{}},
          {"literature choroid", literature_choroid()},
          {"vitreous", with_vitreous()},
          {"thin RPE", thin},
          {"small spot", small_spot},
          {"narrow domain", narrow},
          {"single layer", single},
          {"peak in the choroid", deep_peak},
          {"Gaussian", gaussian(Tissue{})},
          {"ring beam", ring_beam(Tissue{})}};
}

}  // namespace photocoag::testing
