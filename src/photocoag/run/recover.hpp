// Role: the program; completes a run folder from its log after a crash. Used by `convert`, session,
// tests. Source: docs/realtime.md.
#pragma once

#include <filesystem>

#include "photocoag/log/reader.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// The treatment as far as it was logged. Cycles whose records were dropped are missing.
Treatment treatment_from(const LogContent& log);

/// Writes run.csv and summary.json beside config.toml and log/. Throws Error if there is a run.csv
/// already, no log, or a log of another configuration. Returns what the log held.
LogContent recover_run(const std::filesystem::path& folder);

}  // namespace photocoag
