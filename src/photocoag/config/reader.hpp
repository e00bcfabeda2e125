// Role: setup; applies value trees to a configuration and keeps the place of every value. Used by
// config, python.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {

/// A file or an option, and the folder for its relative paths.
struct Source {
  Value root;
  std::string folder;
};

struct Place {
  std::string where;
  std::string text;       ///< a number as it was written; empty for anything else
  std::size_t order = 0;  ///< order of reading: the last one given has the highest
};

/// By full key; layers by name: "tissue.layers.RPE.thickness_um".
using Places = std::map<std::string, Place>;

/// Applies the sources in their order (later ones win) to `config`, [plant.tissue] after all of
/// [tissue]. Checks keys and types, not ranges. Throws Error.
Places read_sources(const std::vector<Source>& sources, Config& config);

/// read_sources on the defaults, then validate(): load_config() for sources already read. `places`
/// as of read_sources. Throws Error with the place of the value.
Config config_of(const std::vector<Source>& sources, Places& places);

}  // namespace photocoag
