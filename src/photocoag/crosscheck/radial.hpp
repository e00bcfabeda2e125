// Role: setup; the radial half of the cross-check. Used by crosscheck. Source: separation of the
// heat equation in a cylinder by Bessel functions (Carslaw and Jaeger, 2nd ed., ch. VII).
// Shares no code with fom: no rings, but closed forms or quadrature of the beam. Units: SI.
#pragma once

#include <vector>

#include "photocoag/tissue/tissue.hpp"

namespace photocoag::crosscheck {

/// With zero temperature at the domain's radius R the temperature is a sum over J0(j_m r / R); in
/// depth each term obeys the heat equation with a loss proportional to rate = (j_m / R)^2. With b_m
/// = int g J0 2 pi r dr of the beam's irradiance g and n_m = pi R^2 J1(j_m)^2 term m has the weight
/// b_m / n_m in the peak on the axis and b_m^2 / n_m in the mean over the beam.
struct RadialTerms {
  std::vector<double> rate;    ///< 1/m2, ascending
  std::vector<double> peak;    ///< 1/m2
  std::vector<double> volume;  ///< 1/m2
};

/// As many terms as the beam's finest feature asks for.
RadialTerms radial_terms(const Tissue& tissue);

/// The same sums taken on `nodes` (rates, ascending and evenly spaced in their logarithm): every
/// term is shared between the four nearest by Lagrange's polynomials, which is as exact as the
/// response is smooth in the logarithm of the rate.
RadialTerms on_nodes(const RadialTerms& terms, const std::vector<double>& nodes);

}  // namespace photocoag::crosscheck
