// Role: study; many random spots treated with the nominal and with the robust controller. Used by
// `photocoag spots`. Source: docs/control.md (robust mode). Units: SI.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/population/draws.hpp"

namespace photocoag {

/// Outcome of one spot.
struct SpotOutcome {
  double alpha = 0.0;
  double peak_max = 0.0;       ///< K, true
  std::size_t violations = 0;  ///< cycles above the configured limit
  double time_to_95_percent =
      0.0;                 ///< s, relative to the controller's own reference; the duration if never
  double held_mean = 0.0;  ///< K, true peak after 50 ms
  double rms_error = 0.0;  ///< K, true peak after 50 ms against the controller's own reference
  double absorption_error = 0.0;  ///< final estimate / truth - 1
};

/// Spots with seeds 1 … count on full-order eyes, on all cores, in the order of the seeds; results
/// do not depend on the number of cores. `limit`: K, for counting violations. Throws Error only
/// before the first spot.
std::vector<SpotOutcome> treat_spots(const Config& config, const ReducedModel& model,
                                     const SpotRange& range, double limit, std::size_t count,
                                     const Progress& progress = {});

/// Effort of the adversary.
struct CornerEffort {
  std::size_t survey = 60;   ///< treatments of every corner
  std::size_t worst = 6;     ///< corners treated further: most violations, then highest peak
  std::size_t count = 1500;  ///< final number of treatments of each of these
};

/// Treatments of one corner of the declared set.
struct CornerOutcome {
  std::string name;  ///< "-+--…": the signs of spot radius, then of each layer's thickness and,
                     ///< where alpha does not scale it, absorption; empty: nothing declared
  std::size_t treatments = 0;
  std::size_t over = 0;         ///< treatments above the limit
  double peak_max = 0.0;        ///< K, true, of all of them
  double peak_max_alpha = 0.0;  ///< of that treatment
  double held_mean = 0.0;       ///< K, mean over the treatments
};

/// An adversary: every combination of the declared extremes, the first two treatments of each at
/// the ends of the range of alpha, the others at random alphas, each with its own noise; then more
/// treatments of the worst corners. Independent of how the margin was found. Corners in the order
/// of their names' bits; otherwise as treat_spots. Nothing declared: one corner, the eye as
/// configured.
std::vector<CornerOutcome> treat_corners(const Config& config, const ReducedModel& model,
                                         const SpotRange& range, double limit,
                                         const CornerEffort& effort, const Progress& progress = {});

}  // namespace photocoag
