// Role: setup; random quantities of an eye: the controller's prior, a campaign's inputs. Used by
// config, session. Format: docs/configuration.md.
// Units: those of the keys.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

enum class Distribution { kNormal, kLogNormal, kUniform };

/// One random quantity, truncated to [low, high].
struct RandomQuantity {
  std::string key;  ///< "plant.absorption_factor", "plant.tissue.…", "calibration_factor", …
  Distribution distribution = Distribution::kUniform;
  double center = 0.0;  ///< mean (normal) or median (log-normal)
  double spread = 0.0;  ///< standard deviation (normal), or of the logarithm (log-normal)
  double low = 0.0;
  double high = 0.0;
  bool considered = false;  ///< a consider parameter: its spread counts, samples do not correct it
                            ///< (Schmidt-Kalman)
  bool operator==(const RandomQuantity&) const = default;
};

/// Correlation of two quantities' normal scores.
struct Correlation {
  std::string first;
  std::string second;
  double value = 0.0;  ///< above -1, below 1
  bool operator==(const Correlation&) const = default;
};

/// Random quantities and their correlations: [[prior]] and [[prior_correlation]] of a
/// configuration, [[input]] and [[correlation]] of a campaign.
struct Prior {
  std::vector<RandomQuantity> quantities;
  std::vector<Correlation> correlations;

  bool declared() const noexcept { return !quantities.empty(); }
  /// The quantity of that key, or nullptr.
  const RandomQuantity* find(std::string_view key) const noexcept;
  bool operator==(const Prior&) const = default;
};

/// Measured over true volume temperature; not a key of the configuration.
inline constexpr std::string_view kCalibrationFactor = "calibration_factor";

}  // namespace photocoag
