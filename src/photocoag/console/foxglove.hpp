// Role: the program; the cycles of a running treatment as messages of Foxglove's WebSocket
// protocol: channels in JSON with their schemas and units, to clients that subscribe. Clients can
// only subscribe and unsubscribe. Used by desk, which adds cycles, and server, which sends. Source:
// docs/console.md (Foxglove). Real time: none. Threads: the server's.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/log/fields.hpp"

namespace photocoag {

/// Names of the same protocol; a client offers one or both.
inline constexpr std::array<const char*, 2> kFoxgloveProtocols = {"foxglove.sdk.v1",
                                                                  "foxglove.websocket.v1"};

class FoxgloveFeed {
 public:
  FoxgloveFeed();

  /// First messages to a client: serverInfo, advertise.
  std::vector<std::string> came(int client);
  void left(int client);
  struct Reply {
    bool good = true;  ///< false: no JSON object with an "op"
    std::string text;  ///< may be empty
  };
  Reply said(int client, std::string_view text);

  bool wanted() const noexcept { return !clients_.empty(); }
  /// Adds a cycle; `unix_ns`: ns since 1970.
  void add(const LogRecord& record, std::int64_t unix_ns);
  /// Binary messages with the cycles added since forget(), for the client's subscriptions.
  std::vector<std::string> messages(int client) const;
  void forget() { added_.clear(); }

 private:
  struct Channel {
    std::string topic;
    std::vector<const CycleField*> fields;
  };
  struct Added {
    std::size_t channel;
    std::int64_t unix_ns;
    std::string payload;
  };
  std::string advertisement() const;

  std::vector<Channel> channels_;                                // id: place + 1
  std::map<int, std::map<std::size_t, std::uint32_t>> clients_;  // channel -> subscription
  std::vector<Added> added_;
};

}  // namespace photocoag
