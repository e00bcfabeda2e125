// Role: setup; reading and writing whole files with errors that name them. Used by config, rom,
// run, report.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace photocoag {

/// Content of a regular file of at most `max_bytes`. Never waits: a device or pipe is refused.
/// Throws Error naming the file; `kind` (e.g. "TOML file") goes into what is accepted.
std::string read_file(const std::string& file, std::size_t max_bytes,
                      std::string_view kind = "file");

/// Writes beside `path`, then renames: readers see the old file or the new one, never half. Throws
/// Error.
void write_file(const std::string& path, std::string_view content);

}  // namespace photocoag
