// Role: setup; the one table of all configuration keys, section by section, made of the rows beside
// each settings aggregate (core/setting.hpp): it drives reading, printing, the check of ranges, the
// detection of unknown keys, the schema and the documentation. Used by config.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/core/setting.hpp"

namespace photocoag {

struct Section {
  std::string_view name;  ///< "control", …, "plant.tissue"
  std::string_view meaning;
};

/// In the order in which they are printed.
const std::vector<Section>& sections();

/// Every key but those inside layers, bound to `config`, section by section.
std::vector<Field> fields(Config& config);

/// Those that every layer of an array needs.
inline constexpr std::array<const char*, 3> kRequiredLayerKeys = {"name", "thickness_um",
                                                                  "absorption_per_m"};

/// The value as it is written in TOML; empty: an optional one that is not given, or layers.
std::string value_text(const Field& field);

}  // namespace photocoag
