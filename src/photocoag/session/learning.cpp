#include "photocoag/session/learning.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {

EstimatorSettings learnt(EstimatorSettings configured, const std::vector<AttemptOutcome>& earlier,
                         double floor) {
  double count = 1.0;  // the configured prior
  double sum = configured.absorption_initial;
  double squares = sum * sum;
  for (const AttemptOutcome& spot : earlier) {
    if (!is_complete(spot.ending) || !std::isfinite(spot.absorption)) continue;
    count += 1.0;
    sum += spot.absorption;
    squares += spot.absorption * spot.absorption;
  }
  if (count == 1.0) return configured;
  const double mean = sum / count;
  const double within = std::max(0.0, squares / count - mean * mean);
  const double variance =
      within + configured.absorption_sigma_initial * configured.absorption_sigma_initial / count;
  configured.absorption_initial =
      std::clamp(mean, configured.absorption_min, configured.absorption_max);
  configured.absorption_sigma_initial =
      std::min(2.0, std::max(floor, std::sqrt(variance * (1.0 + 1.0 / count))));
  return configured;
}

}  // namespace photocoag
