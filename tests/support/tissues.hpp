// Role: tests; tissues that differ from the default in what could go wrong.
#pragma once

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

/// 2 mm of vitreous in front, a thick sclera behind.
inline Tissue with_vitreous() {
  Tissue tissue;
  tissue.layers[4].thickness = 2000e-6;
  tissue.layers.insert(tissue.layers.begin(), Layer{"vitreous", 2000e-6, 0.0, false});
  return tissue;
}

inline Tissue normalized(Tissue tissue) {
  tissue.volume_temperature = VolumeTemperature::kNormalized;
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
  single.layers = {{"RPE", 300e-6, 5000.0, true}};
  Tissue deep_peak;
  deep_peak.peak_layer = "choroid";
  return {{"default", Tissue{}},         {"literature choroid", literature_choroid()},
          {"vitreous", with_vitreous()}, {"thin RPE", thin},
          {"small spot", small_spot},    {"narrow domain", narrow},
          {"single layer", single},      {"peak in the choroid", deep_peak}};
}

}  // namespace photocoag::testing
