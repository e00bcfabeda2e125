// Role: simulation; the eye's socket thread: accepts one controller at a time, answers text
// commands, gives observers the published memory. Used by eye_server. Source: docs/devices.md,
// "Transports". Threads: its own; EyeSharedState is what it shares with the pulse thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "photocoag/eye/fault_script.hpp"
#include "photocoag/rt/eye_protocol.hpp"
#include "photocoag/rt/eye_socket.hpp"
#include "photocoag/rt/sealed_memory.hpp"

namespace photocoag {

/// An accepted controller, passed from the socket thread to the pulse thread.
struct EyeClient {
  int socket = -1;
  std::uint32_t pulses_per_period = 1;
  Mapped<EyeOrderMemory> orders;  ///< null: commands come through the socket
};

/// Data shared by both threads.
struct EyeSharedState {
  EyeSharedMemory* memory = nullptr;
  int descriptor = -1;  ///< of the memory, for observers
  std::int64_t pulse_ns = 0;
  std::uint64_t states = 0;
  double power_max = 0.0;  ///< W
  std::atomic<bool> priority{false};
  std::atomic<bool> attached{false};  ///< a client is attached or attaching
  std::atomic<EyeClient*> arriving{nullptr};
  std::atomic<bool> lockstep{false};
  std::atomic<bool> cold{false};
  std::atomic<bool> end{false};
  // For the "status" line.
  std::atomic<std::uint64_t> late{0};
  std::atomic<std::uint64_t> watchdog{0};
  std::atomic<std::uint64_t> refused{0};  ///< commands beyond power_max
  std::atomic<std::uint64_t> lit{0};      ///< pulses with light
  std::atomic<double> work_p50{0.0};
  std::atomic<double> work_p99{0.0};
  std::atomic<double> work_max{0.0};
};

class EyeSocketServer {
 public:
  static constexpr std::size_t kMostPeers =
      16;  ///< connections; the oldest is dropped for a new one

  EyeSocketServer(EyeSharedState& shared, FaultScript& faults, const Listener& listener)
      : shared_(shared), faults_(faults), listener_(listener) {}
  ~EyeSocketServer();
  EyeSocketServer(const EyeSocketServer&) = delete;
  EyeSocketServer& operator=(const EyeSocketServer&) = delete;

  /// Serves until shared.end.
  void run();

 private:
  void accept_peer();
  void drop(int peer, bool closing);
  static void say(int peer, const std::string& text);
  void serve(int peer);
  void welcome(int peer, const EyeHello& hello);
  void answer(int peer, const std::string& text);
  std::string status() const;
  void add_fault(int peer, const std::string& text);

  EyeSharedState& shared_;
  FaultScript& faults_;
  const Listener& listener_;
  std::vector<int> peers_;  // oldest first
  EyeClient client_;
};

}  // namespace photocoag
