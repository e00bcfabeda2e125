// Role: the program; a treatment on a device: the simulated eye of another process, or a vendor's
// driver. Used by `treat --device`, tests. Source: docs/devices.md. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/photoacoustics/curve.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/treatment.hpp"
#include "photocoag/safety/limits.hpp"

namespace photocoag {

/// "eye", "eye:SOCKET", "eye+socket[:SOCKET]", "driver:LIBRARY[,SETTINGS]".
struct DeviceAddress {
  enum class Kind { kEye, kDriver };
  Kind kind = Kind::kEye;
  bool own_process = false;  ///< an eye that the program starts and ends itself
  bool over_socket = false;  ///< the eye's pulses come through the socket
  std::string path;          ///< socket or library
  std::string settings;      ///< of a driver

  bool eye() const noexcept { return kind == Kind::kEye; }
};
/// Throws Error naming --device.
DeviceAddress parse_device(const std::string& text);

/// A device that is not there or fails: exit code 3.
class DeviceError : public Error {
 public:
  using Error::Error;
  explicit DeviceError(const Error& error) : Error(error) {}
};

/// Throws Error unless the calibration covers ambient to control.peak_max_K and rises by 0.3 to 15
/// % per K when cold.
void require_plausible(const GrueneisenCurve& curve, const Config& config);

/// What the configuration must say for a device, said: an eye's samples are means over pulses of
/// the normalised volume temperature. Throws Error if that is not possible.
Config for_device(Config config, const DeviceAddress& device);

/// The supervisor's limits on a device.
SafetyLimits device_limits(const Config& config);

/// Pulses per control period. Throws Error naming photoacoustics.pulse_period_ms.
int pulses_per_period(const Config& config);

/// Starts `photocoag eye` with the configuration file for the time of its life. `once`: it ends by
/// itself with its first controller, else it is asked to.
class EyeProcess {
 public:
  /// Throws DeviceError if it does not come up.
  EyeProcess(const std::filesystem::path& config_file, const std::vector<std::string>& arguments,
             bool once = true);
  ~EyeProcess();
  EyeProcess(const EyeProcess&) = delete;
  EyeProcess& operator=(const EyeProcess&) = delete;
  const std::string& socket() const noexcept { return socket_; }
  int id() const noexcept { return id_; }

 private:
  std::string folder_;
  std::string socket_;
  int id_ = -1;
  bool once_;
};

/// Self-test and treatment on the device. Throws DeviceError before the loop only.
Treatment run_device_treatment(const Config& config, const DeviceAddress& device,
                               ModelStore& models, const std::atomic<bool>& stop,
                               std::atomic<std::size_t>& progress,
                               const std::filesystem::path& log_folder);

/// True if the supervisor stopped for something that the device did.
bool is_device_fault(SafetyReason reason) noexcept;

}  // namespace photocoag
