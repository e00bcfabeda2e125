// Role: setup; the axial half of the cross-check. Used by crosscheck. Source: linear finite
// elements in depth with consistent mass (the full-order model has finite volumes) and Alexander's
// L-stable method of third order in time (SIAM J. Numer. Anal. 14 (1977) 1006-1021; the full-order
// model is exact or of second order). Layers may differ in everything. Units: SI.
#pragma once

#include <cstddef>
#include <vector>

#include "photocoag/crosscheck/radial.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag::crosscheck {

/// Several sources at once: `count` numbers for each inner node, node by node.
struct Sources {
  std::size_t count = 0;
  std::vector<double> load;
};

/// Cold tissue under a step of power, at given times and, as the last entry, in steady state.
struct StepSamples {
  std::vector<double> peak;  ///< per time and source: at the peak's depth
  std::vector<double>
      gram;  ///< per time, source a, source b: heat of a, measured with the weights of b
};

/// Piecewise linear functions of depth, 0 at both ends.
class DepthElements {
 public:
  explicit DepthElements(const Tissue& tissue);

  std::size_t nodes() const noexcept { return depth_.size() - 2; }  ///< inner ones
  /// int mu exp(-int mu) phi_i dz for all inner nodes i: the source of 1 W/m2, and the weights of
  /// the volume temperature.
  std::vector<double> load(const Tissue& tissue, AbsorptionFactors at) const;

  /// Adds the step response of every radial term, times the term's weights. `times`: s, ascending.
  void add_steps(const RadialTerms& terms, const Sources& sources, const std::vector<double>& times,
                 StepSamples& sum) const;

 private:
  std::vector<double> depth_;         // m, all nodes with both ends
  std::vector<std::size_t> layer_;    // of each element
  std::vector<ThermalData> thermal_;  // of each layer
  std::size_t peak_ = 0;              // inner node
};

/// int mu exp(-int mu) dz over the whole tissue.
double absorbed_fraction(const Tissue& tissue, AbsorptionFactors at);

}  // namespace photocoag::crosscheck
