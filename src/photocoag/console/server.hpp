// Role: the program; one page and one WebSocket on the loopback interface. Used by apps, tests.
// Source: docs/console.md (protocol, limits). Independent of treatments: all content comes from its
// hooks. Real time: none. Threads: its own thread calls all hooks; no hook may wait for the
// treatment loop.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace photocoag {

class FoxgloveFeed;

/// Something a browser can fetch.
struct WebFile {
  std::string type;     ///< Content-Type
  std::string content;  ///< bytes
  bool page = true;     ///< true: the console's page with its strict policy; false: a report, which
                        ///< has its own
};

/// Limits of clients; violations are refused, logged and counted.
struct ServerLimits {
  int clients = 8;                        ///< WebSockets at once
  int connections = 40;                   ///< of any kind
  std::size_t message_bytes = 512;        ///< of a client's message
  std::size_t foxglove_bytes = 4096;      ///< the same of a Foxglove client
  int messages_per_second = 50;           ///< of one client
  std::size_t queue_bytes = 1024 * 1024;  ///< queued for one client
  double tick_s = 0.033;                  ///< interval of messages to all
};

struct ServerSettings {
  std::uint16_t port = 0;  ///< 0: any free port
  std::string token;       ///< secret that a client must know; not empty
  ServerLimits limits;
  /// Origins from which Foxglove clients are accepted, besides those without an origin.
  std::vector<std::string> foxglove_origins = {};
};

struct ServerHooks {
  std::function<std::vector<std::string>(int client)> came;               ///< messages for it alone
  std::function<std::string(int client, std::string_view message)> said;  ///< answer, or empty
  std::function<void(int client)> left;
  std::function<std::vector<std::string>()> tick;                     ///< messages for all
  std::function<std::optional<WebFile>(std::string_view path)> file;  ///< files without token
  /// Files below /runs/, for clients with the token.
  std::function<std::optional<WebFile>(std::string_view path)> run_file;
  std::function<void(std::string_view line)> log;
  FoxgloveFeed* foxglove = nullptr;  ///< none: no such clients
};

/// Counts of refusals.
struct Refusals {
  std::atomic<std::uint64_t> origin{0};     ///< a page from elsewhere
  std::atomic<std::uint64_t> token{0};      ///< missing or wrong
  std::atomic<std::uint64_t> crowd{0};      ///< too many clients or connections
  std::atomic<std::uint64_t> oversized{0};  ///< a message above the limit
  std::atomic<std::uint64_t> malformed{0};  ///< binary, or not a known command
  std::atomic<std::uint64_t> flood{0};      ///< too many messages
  std::atomic<std::uint64_t> slow{0};       ///< did not accept what was sent
  std::uint64_t total() const noexcept;
};

class ConsoleServer {
 public:
  /// Listens on 127.0.0.1 and starts its thread. Throws Error naming --port.
  ConsoleServer(ServerSettings settings, ServerHooks hooks);
  ~ConsoleServer();
  ConsoleServer(const ConsoleServer&) = delete;
  ConsoleServer& operator=(const ConsoleServer&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  /// Its address with the token in the fragment, which browsers do not send.
  std::string address() const;
  /// The address for Foxglove clients.
  std::string foxglove_address() const;
  /// False once its thread has ended, for whatever reason.
  bool alive() const noexcept { return alive_.load(std::memory_order_relaxed); }
  const Refusals& refusals() const noexcept;
  /// Ends the thread and all connections. May be called again.
  void stop() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::uint16_t port_ = 0;
  std::atomic<bool> alive_{false};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace photocoag
