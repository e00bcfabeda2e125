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

/// A log in `folder` for a treatment on `device` (empty: the simulated eye of this process);
/// options.ring_records = 0: room for one second of cycles. Throws Error if the log cannot be
/// started or the disk is too full for the treatment.
std::unique_ptr<LogWriter> start_log(const Config& config, ModelStore& models,
                                     const std::filesystem::path& folder, std::string device,
                                     LogOptions options = {});

/// Writes what is left; returns how the log ended.
LogOutcome finish_log(LogWriter& log);

}  // namespace photocoag
