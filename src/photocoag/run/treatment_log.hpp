// Role: setup; opens and closes the crash-safe log of one treatment. Used by run. Source:
// docs/realtime.md.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/log/writer.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// A log in `folder`, of a treatment on `device` (empty: the simulated eye of this process), with
/// room in its ring for a second of cycles, if options.ring_records is 0. Throws Error where the
/// log cannot be started or the disk has no room for the treatment.
std::unique_ptr<LogWriter> start_log(const Config& config, ModelStore& models,
                                     const std::filesystem::path& folder, std::string device,
                                     LogOptions options = {});

/// Writes what is left and says how it ended.
LogOutcome finish_log(LogWriter& log);

}  // namespace photocoag
