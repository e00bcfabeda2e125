// Role: setup; reading and writing whole files with errors that name them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace photocoag {

/// Content of a regular file of at most `max_bytes`. Throws Error: missing, not a regular file, too
/// large.
std::string read_file(const std::string& path, std::size_t max_bytes);

/// Writes beside `path`, then renames: readers see the old file or the new one, never half. Throws
/// Error.
void write_file(const std::string& path, std::string_view content);

}  // namespace photocoag
