// Role: setup; an independent computation of the tissue's responses, to check others against.
// Source: separation of variables (radial.hpp, axial.hpp). Shares no code with fom and mor: Bessel
// functions in the radius, finite elements in depth, its own time stepping.
// Units: SI.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag::crosscheck {

/// K/W, of one absorption (alpha, beta).
struct LagWeights {
  std::vector<double> peak;
  std::vector<double> volume;
};

/// Temperatures as sums of first-order lags x' = -rate x + u: the response to a step of 1 W is
/// sum_i weight_i (1 - exp(-rate_i t)), so that a weight is the lag's steady gain.
struct LagSums {
  std::vector<double> rate;    ///< 1/s, ascending
  std::vector<LagWeights> at;  ///< one per absorption
  double fit_error = 0.0;  ///< largest deviation of a lag sum from the computed response, relative
                           ///< to that response, from the end of the first period on
};

/// Responses of `tissue` at each absorption, accurate from a small fraction of `period`, s, on.
/// Throws Error if the tissue is not valid.
LagSums tissue_lags(const Tissue& tissue, std::span<const AbsorptionFactors> at, double period);

/// Decay factor of a lag over one period of a time scheme.
double decay_of(Discretization scheme, double rate, double period);

/// The response to a step of 1 W at the ends of the periods 1, 2, …: sum_i weight_i (1 - decay^k).
double step_response(const std::vector<double>& weights, const std::vector<double>& decays,
                     double periods);

/// The same responses in discrete time, with few lags s <- decay s + u: the response to a step of
/// 1 W is sum_i weight_i (1 - decay_i^k) / (1 - decay_i).
struct FewLags {
  std::vector<double> decay;   ///< per period
  std::vector<LagWeights> at;  ///< one per absorption
  /// K/W: the largest deviation from the many lags under any powers from 0 to 1 W.
  double peak_error = 0.0;
  double volume_error = 0.0;
};

/// `count` lags, their rates spread evenly in logarithm, weights by least squares.
FewLags few_lags(const LagSums& lags, std::size_t count, Discretization scheme, double period);

}  // namespace photocoag::crosscheck
