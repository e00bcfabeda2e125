// Role: offline; random eyes: draws configuration values from a joint distribution and sets them.
// Used by campaign, session. Format: docs/studies.md. Units: those of the keys.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/random_quantities.hpp"
#include "photocoag/core/types.hpp"

namespace photocoag {

struct EyeDraws {
  std::uint64_t seed = 1;
  std::vector<RandomQuantity> inputs;
  Eigen::MatrixXd correlation_root;  ///< lower Cholesky factor of the inputs' correlation
};

/// Like kCalibrationFactor, not keys of the configuration: the offset of the measured volume
/// temperature, and the actual delay in periods (rounded to 0 or 1) until a power is emitted,
/// whatever control.delay_cycles.
inline constexpr std::string_view kCalibrationOffset = "calibration_offset_K";
inline constexpr std::string_view kDelay = "delay_cycles";

/// The values of all inputs for an eye: a function of (seed, eye) alone. Throws Error if draws
/// almost never satisfy the bounds.
std::vector<double> draw_inputs(const EyeDraws& draws, std::uint64_t eye);
/// Seed of the measurement noise of an eye.
std::uint64_t noise_seed(const EyeDraws& draws, std::uint64_t eye) noexcept;

/// Sets inputs of one configuration repeatedly, without parsing.
class InputSetter {
 public:
  /// Throws Error if a key is not a number of the eye. `config` must outlive it and stay in place.
  InputSetter(const EyeDraws& draws, Config& config);
  void set(const std::vector<double>& values) noexcept;
  double calibration_factor() const noexcept { return factor_; }
  double calibration_offset() const noexcept { return offset_; }
  std::optional<int> delay() const noexcept;  ///< empty: as configured for the controller

 private:
  std::vector<EyeNumber> targets_;
  double factor_ = 1.0;
  double offset_ = 0.0;  ///< K
  double delay_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace photocoag
