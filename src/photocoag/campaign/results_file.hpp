// Role: offline; the table of a campaign as HDF5, for Python, MATLAB and R. Used by `photocoag
// campaign`. Format: docs/studies.md. The same campaign gives the same bytes: no time stamps.
#pragma once

#include <filesystem>
#include <vector>

#include "photocoag/campaign/spot.hpp"

namespace photocoag {

/// Dataset /spots: one compound row per spot, by number; attributes with units, meanings,
/// distributions, campaign file, configuration and program version. Replaces an older file at the
/// end. Throws Error.
void write_results(const std::filesystem::path& file, const Campaign& campaign,
                   const std::vector<SpotRecord>& spots);

}  // namespace photocoag
