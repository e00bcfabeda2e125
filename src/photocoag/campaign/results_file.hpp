// Role: offline; the table of a campaign as HDF5, for Python, MATLAB and R. Used by `photocoag
// campaign`. Format: docs/studies.md. The same campaign gives the same bytes: no time stamps.
// Memory does not depend on the number of spots. Real-time promise: none.
#pragma once

#include <filesystem>

#include "photocoag/campaign/journal.hpp"
#include "photocoag/campaign/spot_rows.hpp"

namespace photocoag {

/// Dataset /spots: one compound row per spot of the journal, by number; attributes with units,
/// meanings, distributions, campaign file, configuration and program version. Replaces an older
/// file at the end; if interrupted it leaves `file` with ".part". Throws Error.
void write_results(const std::filesystem::path& file, const Campaign& campaign,
                   const Journal& journal);

/// The rows of a file that write_results has made of this campaign. Throws Error.
SpotRows open_results(const std::filesystem::path& file, const Campaign& campaign);

/// Bytes of a row.
std::size_t bytes_per_row(const Campaign& campaign);

}  // namespace photocoag
