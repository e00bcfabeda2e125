// Role: the program; feeds a run folder's samples to the controller again and compares the powers.
// Used by `replay`, tests. Source: docs/devices.md. Units: SI.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/loop/replay_device.hpp"
#include "photocoag/run/run_csv.hpp"

namespace photocoag {

/// The periods of a run as the device delivered them; `delay`: periods from a command to its
/// emission. Data that run.csv does not contain (converter codes, switches) are taken as healthy; a
/// power that was written but never applied is NaN. Throws Error if a column is missing.
std::vector<ReplayCycle> replay_of(const RunCsv& run, double period, int delay = 0);

struct ReplayOutcome {
  std::size_t compared = 0;    ///< powers
  std::size_t differs_at = 0;  ///< first cycle with a different power; `compared` if none
  bool same() const noexcept { return differs_at == compared; }
};

/// Runs controller and supervisor of RUN/config.toml on RUN/run.csv. Throws Error.
ReplayOutcome replay_run(const std::filesystem::path& folder, bool use_cache);

}  // namespace photocoag
