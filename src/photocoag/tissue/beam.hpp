// Role: offline; the beam's radial profile. Used by fom (source and volume output). Source: paper,
// section 2 (flat top); Gaussian and tabulated profiles are ours. docs/equations.md (E2). Units:
// SI.
#pragma once

#include <vector>

#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// The normalised irradiance g(r), 1/m2, with int_0^R g(r) 2 pi r dr = 1 over the domain of radius
/// R, so that no power is lost at its edge. The volume temperature is the mean weighted with the
/// same g, which keeps the volume output the input's adjoint.
///   flat top  1 / (pi R_I^2) inside R_I
///   Gaussian  2 / (pi w^2) exp(-2 r^2 / w^2) / (1 - exp(-2 R^2 / w^2)), w = spot radius
///   table     linear between the radii, the first value inside the first radius, 0 beyond the last
class Beam {
 public:
  /// Throws Error if the tissue is not valid.
  explicit Beam(const Tissue& tissue);

  /// Share of the power between two radii inner <= outer, m: int_inner^outer g 2 pi r dr, exact.
  double share(double inner, double outer) const;

 private:
  BeamProfile profile_;
  double spot_radius_;
  double domain_radius_;
  std::vector<double> radii_;        // of the table, from 0 on
  std::vector<double> intensities_;  // normalised: per 1/(2 pi)
};

}  // namespace photocoag
