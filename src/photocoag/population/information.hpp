// Role: offline; how accurately the peak can be known in eyes of a prior, and how much knowing each
// quantity would improve it. Used by `photocoag information`. Source:
// docs/uncertainty.md. Units: SI, K. Real time: no.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Means over the eyes, cycle by cycle.
struct InformationCase {
  std::string known;               ///< quantity assumed exactly known; empty: none
  std::vector<double> peak_sigma;  ///< K, root mean square of the stated deviation of the peak,
                                   ///< scaled to the reference
  std::vector<double> peak_error;  ///< K, root mean square of the estimated peak's error, likewise
  double held = 0.0;               ///< K, mean true peak over the second half, minus the reference
};

struct Information {
  std::size_t eyes = 0;
  double period = 0.0;                 ///< s
  std::vector<InformationCase> cases;  ///< first: nothing is known exactly
};

/// `eyes` treatments of the configuration's prior, closed loop, for each case: the eyes are the
/// uncertain model itself, so that the result shows inference alone, without model error. Throws
/// Error if the configuration does not use a prior.
Information information_of(const Config& config, const ReducedModel& model, std::size_t eyes);

/// Name of a quantity for people: "thickness of RPE".
std::string quantity_name(const UncertainQuantity& quantity);

}  // namespace photocoag
