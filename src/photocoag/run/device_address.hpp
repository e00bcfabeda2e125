// Role: the program; where a device is: `--device`. Used by run, apps. Source: docs/devices.md.
#pragma once

#include <string>

#include "photocoag/core/error.hpp"

namespace photocoag {

/// "eye", "eye:SOCKET", "eye+socket[:SOCKET]", "driver:LIBRARY[,SETTINGS]". LIBRARY is the longest
/// part before a comma that is a file: its path may hold commas.
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

}  // namespace photocoag
