// Role: the program; common parts of `console` and `console --session`: the terminal, the server's
// settings, the device's description.
#pragma once

#include <chrono>
#include <optional>

#include "console_command.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/console/describe.hpp"
#include "photocoag/console/desk.hpp"
#include "photocoag/console/server.hpp"
#include "photocoag/run/device_address.hpp"

namespace photocoag {

/// Polling interval of terminal, server and signals while nothing is treated.
inline constexpr std::chrono::milliseconds kConsolePoll{50};

ConsoleDevice console_device(const Config& config, const DeviceAddress& place);

/// With a new token.
ServerSettings console_settings(const ConsoleOptions& options);
ServerHooks console_hooks(Desk& desk);
void say_address(const ConsoleOptions& options, const ConsoleServer& server, bool browser_starts);

/// Detects Enter at the terminal, if standard input is an open one.
class Terminal {
 public:
  bool enter() noexcept;

 private:
  bool open_ = true;
};

}  // namespace photocoag
