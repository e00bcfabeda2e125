// Role: setup; value trees into a configuration, with the place of every value kept. Used by
// config.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {

/// A file or an option, and the folder that its relative paths start from.
struct Source {
  Value root;
  std::string folder;
};

struct Place {
  std::string where;
  std::string text;       ///< a number as it was written; empty for anything else
  std::size_t order = 0;  ///< of reading: the last one given has the highest
};

/// By full key; layers by name: "tissue.layers.RPE.thickness_um".
using Places = std::map<std::string, Place>;

/// Applies the sources in their order (later ones win) to `config`, [plant.tissue] after all of
/// [tissue]. Checks keys and types, not ranges. Throws Error.
Places read_sources(const std::vector<Source>& sources, Config& config);

/// read_sources on the defaults, then validates all of it: load_config() of sources that are there
/// already. `places` as of read_sources. Throws Error with the place of the value.
Config config_of(const std::vector<Source>& sources, Places& places);

}  // namespace photocoag
