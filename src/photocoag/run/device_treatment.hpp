// Role: the program; a treatment on a device: the simulated eye of another process, or a vendor's
// driver. Used by `treat --device`, tests. Source: docs/devices.md. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>

#include "photocoag/config/config.hpp"
#include "photocoag/run/device_address.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/treatment.hpp"
#include "photocoag/safety/states.hpp"

namespace photocoag {

/// Self-test and treatment on the device. Throws DeviceError before the loop only.
Treatment run_device_treatment(const Config& config, const DeviceAddress& device,
                               ModelStore& models, const std::atomic<bool>& stop,
                               std::atomic<std::size_t>& progress,
                               const std::filesystem::path& log_folder,
                               const Onlooker& onlooker = {});

/// True if the supervisor stopped for something that the device did.
bool is_device_fault(SafetyReason reason) noexcept;

}  // namespace photocoag
