// Role: offline; compares filter and moving horizon for one and two unknown absorption factors,
// over many eyes. Used by `photocoag estimation --compare`, tests. Source: the comparison of
// Kleyman and others (2022, abstract); docs/estimation.md. Units: SI.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {

/// An estimator and the eyes it meets.
struct UnknownsCase {
  std::string name;
  EstimatorSettings estimator;
  bool choroid_varies = false;  ///< true: beta of the eyes log-uniform over [0.5, 2]; false: 1
  bool dark = false;            ///< 0 W throughout instead of the controller's power
};

/// Over all eyes at the end of one cycle. Root mean squares; errors of the factors are relative.
struct UnknownsCycle {
  double alpha = 0.0;
  double beta = 0.0;
  double peak = 0.0;        ///< K
  double nees_alpha = 0.0;  ///< squared error over the stated variance; 1 is consistent
  double nees_beta = 0.0;   ///< 0 where beta is not estimated
  double at_bound = 0.0;    ///< fraction of the eyes with an estimate at one of its bounds
};

struct UnknownsResult {
  UnknownsCase which;
  std::vector<UnknownsCycle> cycles;
  int limit_exceeded = 0;  ///< eyes whose true peak exceeded control.peak_max

  /// Over cycles [begin, end): root mean squares, and means of fractions.
  UnknownsCycle over(std::size_t begin, std::size_t end) const;
};

/// `seeds` closed loops with full-order eyes, alpha drawn evenly from [0.35, 1.5]; the same eyes
/// and noise for every case. The model of `config` must have both parameters: throws Error.
/// Deterministic. Allocates.
UnknownsResult unknowns_study(const Config& config, ModelStore& models, const UnknownsCase& which,
                              int seeds);

/// Both estimators with one unknown and a known choroid, with one and an unknown choroid, with two,
/// with bounds too wide to count, with a vague prior (deviations of 1) with and without bounds, and
/// with no light.
std::vector<UnknownsCase> unknowns_cases(const Config& config);

}  // namespace photocoag
