// Role: the program; the simulated eye's process, started and ended. Used by `treat --device eye`,
// apps. Source: docs/devices.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace photocoag {

/// Starts `photocoag eye` with the configuration file for the time of its life, at an abstract
/// socket. `once`: it ends by itself with its first controller, else it is asked to; in any case
/// with this process.
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
  std::string socket_;
  int id_ = -1;
  bool once_;
};

}  // namespace photocoag
