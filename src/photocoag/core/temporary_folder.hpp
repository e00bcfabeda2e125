// Role: setup; a new folder for what a command needs while it runs. Used by apps, fault_table.
#pragma once

#include <string>

namespace photocoag {

/// "PREFIXxxxxxx", this user's alone, below TMPDIR; if that is no folder one can write to, below
/// /tmp, /var/tmp or /dev/shm. Throws Error naming TMPDIR. The caller removes it.
std::string make_temporary_folder(const std::string& prefix);

}  // namespace photocoag
