#include "console_parts.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <string_view>

#include "console.hpp"
#include "photocoag/console/page_files.hpp"
#include "photocoag/console/token.hpp"

namespace photocoag {
namespace {

std::string words_of(const Config& config, const DeviceAddress& place) {
  if (place.here()) {
    return config.plant.model == PlantModel::kFull ? "simulated eye, full order"
                                                   : "simulated eye, reduced model";
  }
  if (!place.eye()) return std::string(word_of(place)) + ' ' + place.path;
  return place.own_process ? "simulated eye in a process of its own"
                           : "simulated eye at " + place.path;
}

}  // namespace

ConsoleDevice console_device(const Config& config, const DeviceAddress& place) {
  return {.name = words_of(config, place),
          .browser_starts = place.simulated(),
          .self_test_first = place.here()};
}

ServerSettings console_settings(const ConsoleOptions& options) {
  return {.port = static_cast<std::uint16_t>(options.port),
          .token = random_token(),
          .limits = {},
          .foxglove_origins = options.foxglove_origins};
}

ServerHooks console_hooks(Desk& desk) {
  return desk.hooks(page_file, [](std::string_view line) { say("{}\n", line); });
}

void say_address(const ConsoleOptions& options, const ConsoleServer& server, bool browser_starts) {
  say("console   {}\n", server.address());
  if (options.foxglove) say("foxglove  {}\n", server.foxglove_address());
  say("          Ctrl-C stops the laser and ends; {}\n",
      browser_starts ? "Enter starts a spot, as the page can"
                     : "Enter starts a spot: the page cannot start a device");
}

bool Terminal::enter() noexcept {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (!open_ || poll(&input, 1, 0) <= 0) return false;
  std::array<char, 256> bytes{};
  const ssize_t count = read(STDIN_FILENO, bytes.data(), bytes.size());
  open_ = count > 0;
  return open_ && std::string_view(bytes.data(), static_cast<std::size_t>(count)).back() == '\n';
}

}  // namespace photocoag
