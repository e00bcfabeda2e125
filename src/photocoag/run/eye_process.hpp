// Role: the program; starts and ends the simulated eye's process. Used by `treat --device eye`,
// apps. Source: docs/devices.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace photocoag {

/// Runs `photocoag eye` with the configuration file during its lifetime, at an abstract socket.
/// `once`: the eye ends with its first controller, else by SIGTERM from the destructor; in any case
/// it ends with this process.
class EyeProcess {
 public:
  /// Throws DeviceError if it does not start.
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
