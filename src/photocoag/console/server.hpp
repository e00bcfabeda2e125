// Role: the program; one page and one WebSocket on the loopback interface. Used by console_command,
// tests. Source: docs/console.md (protocol, limits). It knows nothing of a treatment: what is said
// and answered comes from its hooks. Real time: none. Threads: one of its own calls all hooks; no
// hook may wait for the treatment loop.
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
  bool page = true;     ///< ours: the strict policy; false: a report, which brings its own
};

/// What a client may take or send; beyond it: refused, logged, counted.
struct ServerLimits {
  int clients = 8;                        ///< WebSockets at once
  int connections = 40;                   ///< of any kind
  std::size_t message_bytes = 512;        ///< of a client's message
  std::size_t foxglove_bytes = 4096;      ///< the same of a Foxglove client
  int messages_per_second = 50;           ///< of one client
  std::size_t queue_bytes = 1024 * 1024;  ///< not yet taken by a client
  double tick_s = 0.033;                  ///< between messages to all
};

struct ServerSettings {
  std::uint16_t port = 0;  ///< 0: any that is free
  std::string token;       ///< what a client must know; not empty
  ServerLimits limits;
  /// Pages whose Foxglove clients are let in beside those that name no origin.
  std::vector<std::string> foxglove_origins = {};
};

struct ServerHooks {
  std::function<std::vector<std::string>(int client)> came;               ///< messages for it alone
  std::function<std::string(int client, std::string_view message)> said;  ///< answer, or empty
  std::function<void(int client)> left;
  std::function<std::vector<std::string>()> tick;                     ///< messages for all
  std::function<std::optional<WebFile>(std::string_view path)> file;  ///< free to all who know ours
  /// Below /runs/, for those who have the token.
  std::function<std::optional<WebFile>(std::string_view path)> run_file;
  std::function<void(std::string_view line)> log;
  FoxgloveFeed* foxglove = nullptr;  ///< none: no such clients
};

/// How often the server has refused what.
struct Refusals {
  std::atomic<std::uint64_t> origin{0};     ///< a page from elsewhere
  std::atomic<std::uint64_t> token{0};      ///< missing or wrong
  std::atomic<std::uint64_t> crowd{0};      ///< too many clients or connections
  std::atomic<std::uint64_t> oversized{0};  ///< a message above the limit
  std::atomic<std::uint64_t> malformed{0};  ///< binary, or no command that there is
  std::atomic<std::uint64_t> flood{0};      ///< too many messages
  std::atomic<std::uint64_t> slow{0};       ///< did not take what was sent
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
  /// Its address with the token in the fragment, which no browser sends.
  std::string address() const;
  /// What a Foxglove client opens.
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
