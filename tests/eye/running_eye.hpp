// An eye's server on a thread of this process, with a coarse tissue.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>

#include "photocoag/eye/eye_server.hpp"
#include "photocoag/rt/eye_device.hpp"
#include "photocoag/rt/eye_link.hpp"
#include "support/reduced_models.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {

inline constexpr double kPulsePeriod = 5e-4;  // s: slow, for busy machines
inline constexpr double kPeriod = 5e-3;

class RunningEye {
 public:
  explicit RunningEye(bool once = false, double lockstep_patience = 10.0, double power_max = 1.0)
      : eye_(coarse_full_model(), 1.1, GrueneisenCurve(water_like_curve()),
             {.pulse_period = kPulsePeriod, .power_max = power_max}, script_) {
    thread_ = std::thread([this, once, lockstep_patience] {
      statistics_ =
          serve_eye({.socket = socket(), .once = once, .lockstep_patience = lockstep_patience},
                    eye_, script_, kPulsePeriod, stop_);
      ended_ = true;
    });
    while (!std::filesystem::exists(socket())) std::this_thread::yield();
  }
  ~RunningEye() { end(); }
  void end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  bool ended_by_itself() {
    for (int i = 0; i < 1000 && !ended_; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return ended_;
  }
  std::string socket() const { return folder_.file("eye"); }
  const EyeStatistics& statistics() const { return statistics_; }
  EyeLinkSettings link(EyeTransport transport) const {
    return {.socket = socket(), .transport = transport, .period = kPeriod, .patience = 400.0};
  }
  /// The number behind `name=` in the eye's status.
  long status(const std::string& name) const {
    const std::string text = command_eye(socket(), "status");
    const std::size_t at = text.find(name + "=");
    return at == std::string::npos ? -1 : std::stol(text.substr(at + name.size() + 1));
  }
  void wait_until_free() const {
    for (int i = 0; i < 1000 && status("attached") != 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

 private:
  TemporaryFolder folder_;
  FaultScript script_;
  PulsedEye eye_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  EyeStatistics statistics_;
  std::thread thread_;
};

}  // namespace photocoag::testing
