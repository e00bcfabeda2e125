// Role: setup; a new folder for a command's temporary files. Used by apps, fault_table.
#pragma once

#include <string>

namespace photocoag {

/// "PREFIXxxxxxx" with mode 0700 below TMPDIR; if that is not writable, below /tmp, /var/tmp or
/// /dev/shm. Throws Error naming TMPDIR. The caller removes it.
std::string make_temporary_folder(const std::string& prefix);

}  // namespace photocoag
