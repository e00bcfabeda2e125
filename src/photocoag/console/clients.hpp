// Role: the program; one client of the console's server with its bounded receive buffer and send
// queue. Used by server. Real time: none. Threads: the server's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "photocoag/console/server.hpp"

namespace photocoag {

class WebClient {
 public:
  struct Bytes {
    std::vector<unsigned char> bytes;  ///< with room in front for the library's header
    bool binary = false;
  };
  /// Shared by all clients.
  using Message = std::shared_ptr<Bytes>;

  WebClient(int id, const ServerLimits& limits, bool foxglove)
      : id_(id), foxglove_(foxglove), limits_(limits) {}
  int id() const noexcept { return id_; }
  /// Speaks Foxglove's protocol, not the console's.
  bool foxglove() const noexcept { return foxglove_; }

  /// Appends part of a message; `to_come`: bytes of its frame still missing. False if it exceeds
  /// the limit.
  bool receive(std::string_view part, std::size_t to_come) {
    if (received_.size() + part.size() + to_come > limits_.message_bytes) return false;
    received_ += part;
    return true;
  }
  std::string take_received() { return std::exchange(received_, {}); }

  /// Counts a message. False if there were too many in the last second.
  bool allow_message(std::int64_t now_us) {
    constexpr std::int64_t kSecond = 1'000'000;
    if (now_us - second_ >= kSecond) {
      second_ = now_us;
      spoken_ = 0;
    }
    return ++spoken_ <= limits_.messages_per_second;
  }

  /// Queues a message. False if the queue is full; the client is then to be disconnected.
  bool push(const Message& message) {
    if (queued_ + message->bytes.size() > limits_.queue_bytes) {
      overflowed_ = true;
      queue_.clear();
      queued_ = 0;
      return false;
    }
    queued_ += message->bytes.size();
    queue_.push_back(message);
    return true;
  }
  Message pop() {
    if (queue_.empty()) return nullptr;
    Message first = std::move(queue_.front());
    queue_.pop_front();
    queued_ -= first->bytes.size();
    return first;
  }
  bool idle() const noexcept { return queue_.empty(); }
  bool overflowed() const noexcept { return overflowed_; }

 private:
  int id_;
  bool foxglove_;
  ServerLimits limits_;
  std::string received_;
  std::int64_t second_ = 0;
  int spoken_ = 0;
  std::deque<Message> queue_;
  std::size_t queued_ = 0;
  bool overflowed_ = false;
};

}  // namespace photocoag
