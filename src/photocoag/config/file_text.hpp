// Role: setup; reads a configuration file that may be anything. Used by config.
#pragma once

#include <string>

namespace photocoag {

/// The content of a regular file of at most 1 MB, without a byte order mark. Never waits: a device
/// or pipe is refused. Throws Error naming the file.
std::string read_configuration_file(const std::string& file);

}  // namespace photocoag
