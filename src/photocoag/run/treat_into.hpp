// Role: the program; one treatment in a run folder that is there: on the simulated eye of this
// process, or on a device. Used by `treat`, `simulate`, session, `console`. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/run/device_address.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// What is treated, and in which time.
struct TreatmentPlace {
  Pacing pacing = Pacing::kClock;
  std::optional<DeviceAddress> device = {};  ///< none: the simulated eye of this process
  std::vector<std::string> faults = {};      ///< of an eye that is started for this treatment
};

/// What the configuration is used for there.
Use use_of(const TreatmentPlace& place);

/// Treats by `controlled` (reference and limit backed off where a margin is wanted). Paced by the
/// clock it keeps the log in `folder`; an eye of its own is started with the folder's config.toml.
/// Throws Error, of a device DeviceError, before the loop only.
Treatment treat_into(const std::filesystem::path& folder, const Config& controlled,
                     const TreatmentPlace& place, ModelStore& models, const std::atomic<bool>& stop,
                     std::atomic<std::size_t>& progress, const Onlooker& onlooker = {});

}  // namespace photocoag
