// Role: offline; the description of a campaign: a configuration and the random properties of the
// spots. Used by campaign. Format: docs/studies.md. Units: those of the keys.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/random_quantities.hpp"
#include "photocoag/core/types.hpp"

namespace photocoag {

struct Campaign {
  std::string file;
  std::string text;  ///< of the file
  std::uint64_t spots = 0;
  std::uint64_t seed = 1;
  Config config;
  std::vector<RandomQuantity> inputs;  ///< the file's own, or the configuration's prior
  Eigen::MatrixXd correlation_root;    ///< lower Cholesky factor of the inputs' correlation

  /// What the results depend on, as a hash: file, configuration, program.
  std::string identity() const;
};

/// Beside kCalibrationFactor no keys of the configuration: the offset of the measured volume
/// temperature, and the periods, rounded to 0 or 1, until a power is really emitted, whatever
/// control.delay_cycles says.
inline constexpr std::string_view kCalibrationOffset = "calibration_offset_K";
inline constexpr std::string_view kDelay = "delay_cycles";

/// Reads and checks everything, the configuration at all lows and at all highs included. Throws
/// Error naming file, key, what was found and what is accepted.
Campaign load_campaign(const std::string& file);

/// The values of all inputs for a spot: a function of (campaign.seed, spot) alone.
std::vector<double> draw_inputs(const Campaign& campaign, std::uint64_t spot);
/// Seed of the measurement noise of a spot.
std::uint64_t noise_seed(const Campaign& campaign, std::uint64_t spot) noexcept;

/// Unit of an input: of its key's ending.
std::string_view input_unit(std::string_view key) noexcept;
/// The input's key without "plant.", "tissue." and "layers.", for columns and headings.
std::string short_name(const std::string& key);

/// Sets inputs of one configuration again and again, without parsing.
class InputSetter {
 public:
  /// Throws Error if a key is not a number of the eye. `config` must outlive it and stay in place.
  InputSetter(const Campaign& campaign, Config& config);
  void set(const std::vector<double>& values) noexcept;
  double calibration_factor() const noexcept { return factor_; }
  double calibration_offset() const noexcept { return offset_; }
  std::optional<int> delay() const noexcept;  ///< empty: as the controller believes

 private:
  std::vector<EyeNumber> targets_;
  double factor_ = 1.0;
  double offset_ = 0.0;  ///< K
  double delay_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace photocoag
