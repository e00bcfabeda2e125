// Role: offline; the description of a campaign: a configuration and the random properties of the
// spots. Used by campaign. Format: docs/studies.md. Units: those of the keys.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/population/eye_draws.hpp"

namespace photocoag {

/// The inputs are the file's own, or the configuration's prior.
struct Campaign : EyeDraws {
  std::string file;
  std::string text;  ///< of the file
  std::uint64_t spots = 0;
  Config config;

  /// What the results depend on, as a hash: file, configuration, program.
  std::string identity() const;
};

/// Reads and checks everything, including the configuration with all inputs at `low` and with all
/// at `high`. Throws Error naming file, key, what was found and what is accepted.
Campaign load_campaign(const std::string& file);

/// Unit of an input, from its key's suffix.
std::string_view input_unit(std::string_view key) noexcept;
/// The input's key without "plant.", "tissue." and "layers.", for columns and headings.
std::string short_name(const std::string& key);

}  // namespace photocoag
