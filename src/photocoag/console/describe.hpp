// Role: the program; describes a treatment before it starts and after it has ended: the messages
// "before" and "spot". Used by apps. Format: docs/console.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/realtime_check/doctor.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// The device, and who may start a spot.
struct ConsoleDevice {
  std::string name;              ///< as shown to users
  bool browser_starts = false;   ///< a simulated eye
  bool self_test_first = false;  ///< self-test before the start; else when a spot starts
};

/// `config`: as the controller gets it (with its margin).
std::string before_message(const Config& config, const ReducedModel& model,
                           const ConsoleDevice& device, const std::vector<Finding>& real_time);

/// `failure`: why the spot did not run at all; else empty.
std::string spot_message(const Config& config, const Treatment& treatment, int number,
                         const std::filesystem::path& folder, const std::string& failure);

}  // namespace photocoag
