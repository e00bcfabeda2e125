// Role: the program; feeds a run folder's samples to the controller again and compares the powers.
// Used by `replay`, tests. Source: docs/devices.md. Units: SI.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/loop/replay_device.hpp"

namespace photocoag {

/// The periods of a run.csv as the device delivered them. Throws Error naming file and line.
/// What run.csv does not hold (converter codes, switches) is taken as healthy.
std::vector<ReplayCycle> read_replay(const std::string& csv_file, double period);

struct ReplayOutcome {
  std::size_t compared = 0;    ///< powers
  std::size_t differs_at = 0;  ///< first cycle with another power; compared if none
  bool same() const noexcept { return differs_at == compared; }
};

/// Runs controller and supervisor of RUN/config.toml on RUN/run.csv. Throws Error.
ReplayOutcome replay_run(const std::filesystem::path& folder, bool use_cache);

}  // namespace photocoag
