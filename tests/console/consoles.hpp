// Servers and desks for the console's tests.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "photocoag/console/desk.hpp"
#include "photocoag/console/page_files.hpp"
#include "photocoag/console/server.hpp"
#include "photocoag/fault_table/raw_client.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag::testing {

constexpr double kPatience = 20.0;  // s: a busy machine, never a measure

inline SafetyLimits some_limits() { return {}; }
inline SelfTestReport good_self_test() { return passed_self_test(some_limits().noise); }

/// A desk behind a server, with no treatment.
struct Console {
  explicit Console(bool browser_starts = true, ServerLimits limits = {})
      : desk({.browser_starts = browser_starts,
              .period = 1e-3,
              .stop = [this] { stop = true; },
              .resume = [this] { stop = false; },
              .before = R"({"type":"before"})"}),
        server(std::make_unique<ConsoleServer>(
            ServerSettings{.port = 0, .token = token, .limits = limits},
            desk.hooks(page_file, [this](std::string_view line) {
              const std::lock_guard lock(mutex);
              log.emplace_back(line);
            }))) {}

  RawClient client() {
    RawClient client(server->port());
    if (client.upgrade({.token = token, .origin = {}, .host = {}}) != 101) {
      throw std::runtime_error("not let in");
    }
    return client;
  }
  std::vector<std::string> logged() {
    const std::lock_guard lock(mutex);
    return log;
  }

  std::string token = "0123456789abcdef0123456789abcdef";
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::vector<std::string> log;
  Desk desk;
  std::unique_ptr<ConsoleServer> server;
};

inline std::string command(std::string_view name) {
  return "{\"command\":\"" + std::string(name) + "\"}";
}

/// Says it and returns the answer.
inline std::string ask(RawClient& client, std::string_view name) {
  client.say(command(name));
  return client.hear_of("\"type\":\"answer\"", kPatience).value_or("no answer");
}

}  // namespace photocoag::testing
