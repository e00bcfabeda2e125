// Role: setup; the table of all configuration keys, section by section, from each settings
// aggregate's fields_of() (core/setting.hpp): it drives reading, printing, range checks, unknown
// keys, the schema and the documentation. Used by config, fmu, apps.
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

/// Required keys of every layer of an array.
inline constexpr std::array<const char*, 3> kRequiredLayerKeys = {"name", "thickness_um",
                                                                  "absorption_per_m"};

/// The value in TOML; empty for an absent optional value and for layers.
std::string value_text(const Field& field);

}  // namespace photocoag
