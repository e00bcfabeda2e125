// Role: setup; reads and writes whole files; errors name them. Used by whatever reads or writes
// files.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace photocoag {

/// Content of a regular file of at most `max_bytes`. Never blocks: a device or pipe is refused.
/// Throws Error naming the file; `kind` (e.g. "TOML file") goes into what is accepted.
std::string read_file(const std::string& file, std::size_t max_bytes,
                      std::string_view kind = "file");

/// `content` without its byte order mark, if it has one. Throws Error naming `where` if there is a
/// second one, or a zero byte (with its line), which many parsers take for the end of the text.
std::string plain_text(std::string content, const std::string& where);

/// Writes a new file beside `path`, then renames it: readers see the old file or the new one, never
/// a partial one. A symbolic link stays and its target is replaced; a pipe, a terminal or another
/// character device (/dev/null, /dev/stdout) is written to. The new file follows no link (O_EXCL)
/// and gets the permissions of the old one. Throws Error.
void write_file(const std::string& path, std::string_view content);

/// What `write` writes into the in-memory file whose name it gets: for libraries that write only to
/// named files. Throws Error, and what `write` throws.
std::string written_by(const std::function<void(const std::string& name)>& write);

}  // namespace photocoag
