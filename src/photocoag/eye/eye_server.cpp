#include "photocoag/eye/eye_server.hpp"

#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/eye/eye_socket_server.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {
namespace {

/// The pulse thread.
class Pulses {
 public:
  Pulses(EyeSharedState& shared, PulsedEye& eye, const EyeServerOptions& options,
         const std::atomic<bool>& stop, EyeStatistics& statistics)
      : shared_(shared),
        memory_(*shared.memory),
        eye_(eye),
        options_(options),
        stop_(stop),
        statistics_(statistics),
        start_ns_(memory_.start_ns.load()) {}

  void run() noexcept {
    for (std::uint64_t number = 0; goes_on(); ++number) {
      if (lockstep_) wait_for_grant(number);
      if (left_lockstep_) anchor(number);
      if (!lockstep_) wait_until(due_ns(number));
      if (!goes_on()) break;
      pulse(number, due_ns(number));
    }
    memory_.gone.store(1);
    leave();
  }

 private:
  bool goes_on() const noexcept {
    return !stop_.load(std::memory_order_relaxed) && !shared_.end.load(std::memory_order_relaxed) &&
           !done_;
  }
  std::int64_t due_ns(std::uint64_t number) const noexcept {
    return start_ns_ + static_cast<std::int64_t>(number) * shared_.pulse_ns;
  }

  /// Return from virtual time to the clock: pulse `number` is due now.
  void anchor(std::uint64_t number) noexcept {
    start_ns_ = monotonic_ns() - static_cast<std::int64_t>(number) * shared_.pulse_ns;
    memory_.start_ns.store(start_ns_);
    left_lockstep_ = false;
  }

  void set_lockstep(bool on) noexcept {
    left_lockstep_ = left_lockstep_ || (lockstep_ && !on);
    lockstep_ = on;
    shared_.lockstep.store(on, std::memory_order_relaxed);
  }

  /// Waits until the controller requests this pulse, has gone, or has been silent for too long.
  void wait_for_grant(std::uint64_t number) noexcept {
    constexpr std::int64_t kPollNs = 20'000;  // ns
    const std::int64_t give_up =
        monotonic_ns() + static_cast<std::int64_t>(options_.lockstep_patience * 1e9);
    for (;;) {
      attend(number);
      if (lockstep_ && !lockstep_told_) {
        const EyeLockstep begun{.pulses = number};
        lockstep_told_ = send_message(client_.socket, &begun, sizeof(begun));
      }
      if (!lockstep_ || granted_ > number || !goes_on()) return;
      const std::int64_t now = monotonic_ns();
      if (now > give_up) return set_lockstep(false);
      wait_until(now + kPollNs);
    }
  }

  void pulse(std::uint64_t number, std::int64_t due) noexcept {
    const std::int64_t begin = monotonic_ns();
    attend(number);
    EyeOrders orders{.tokens = tokens_,
                     .seen = seen_,
                     .safe_off = safe_off_,
                     .pulses_per_period = static_cast<int>(client_.pulses_per_period),
                     .begin = begin_};
    take_command(number / client_.pulses_per_period, orders);
    PulseRecord& record = memory_.records[number % kEyeRing];
    eye_.fire(number, due, orders, record);
    if (eye_.late_ms() > 0.0 && !lockstep_) {
      wait_until(monotonic_ns() + static_cast<std::int64_t>(eye_.late_ms() * 1e6));
    }
    if (eye_.vanished()) {
      done_ = true;
      return;
    }
    record.answered_ns = lockstep_ ? due : monotonic_ns();
    const bool late = record.answered_ns > due + shared_.pulse_ns;
    if (late) record.flags |= kEyeLate;
    memory_.pulses.store(number + 1, std::memory_order_release);
    const bool by_socket = client_.socket >= 0 && client_.orders == nullptr;
    if (by_socket) send_message(client_.socket, &record, sizeof(record));
    const PulseTruth truth = eye_.settle();
    memory_.truth[number % kEyeRing] = truth;
    memory_.truths.store(number + 1, std::memory_order_release);
    if (by_socket) send_message(client_.socket, &truth, sizeof(truth));
    count(record, truth, due, begin, late);
  }

  void count(const PulseRecord& record, const PulseTruth& truth, std::int64_t due,
             std::int64_t begin, bool late) noexcept {
    EyeStatistics& s = statistics_;
    s.work.add(monotonic_ns() - begin);
    if (lockstep_) {
      ++s.lockstep;
    } else {
      s.answer.add(record.answered_ns - due);
    }
    ++s.pulses;
    s.late += late ? 1 : 0;
    s.peak_mean_max = std::max(s.peak_mean_max, truth.peak_mean);
    s.peak_pulse_max = std::max(s.peak_pulse_max, truth.peak_pulse);
    if (late) shared_.late.fetch_add(1, std::memory_order_relaxed);
    if (record.power_readback > 0.0) shared_.lit.fetch_add(1, std::memory_order_relaxed);
    if (record.power_readback == 0.0 && ordered_ > 0.0) {
      ++s.watchdog;
      shared_.watchdog.fetch_add(1, std::memory_order_relaxed);
    }
    constexpr std::uint64_t kRefresh = 1000;
    if (s.pulses % kRefresh == 0) {
      shared_.work_p50.store(s.work.quantile_us(0.5), std::memory_order_relaxed);
      shared_.work_p99.store(s.work.quantile_us(0.99), std::memory_order_relaxed);
      shared_.work_max.store(s.work.max_us(), std::memory_order_relaxed);
    }
  }

  /// Handles arriving and leaving controllers and their messages. `number`: of the next pulse.
  void attend(std::uint64_t number) noexcept {
    if (shared_.cold.exchange(false)) eye_.cool();
    if (client_.socket < 0) {
      EyeClient* arriving = shared_.arriving.exchange(nullptr, std::memory_order_acquire);
      if (arriving == nullptr) return;
      welcome(std::move(*arriving));
    }
    const std::uint64_t period = number / client_.pulses_per_period;
    EyeCommand message;
    for (int i = 0; i < 8; ++i) {
      const long got = receive_message(client_.socket, &message, sizeof(message), 0);
      if (got == kNoMessage) break;
      if (got == 0) return leave();
      if (got == static_cast<long>(sizeof(message))) hear(message, period);
    }
    if (client_.orders == nullptr) return;
    const EyeOrderMemory& orders = *client_.orders;
    for (std::size_t i = 0; i < orders.commands.size(); ++i) {
      const EyeOrderMemory::Command& slot = orders.commands[i];
      const std::uint64_t before = slot.period.load(std::memory_order_acquire);
      const Command command{.token = slot.token.load(std::memory_order_acquire),
                            .period = before - 1,
                            .power = slot.power.load(std::memory_order_acquire)};
      if (before != 0 && slot.period.load(std::memory_order_acquire) == before &&
          command.token != commands_[i].token) {
        take_in(command, i, period);
      }
    }
    granted_ = std::max(granted_, orders.granted.load(std::memory_order_acquire));
    if (orders.safe_off.load(std::memory_order_relaxed) != 0) safe_off_ = true;
  }

  void welcome(EyeClient client) noexcept {
    client_ = std::move(client);
    safe_off_ = false;
    begin_ = UINT64_MAX;
    ordered_ = 0.0;
    taken_ = 0;
    seen_ = 0;
    granted_ = 0;
    commands_.fill({});
    eye_.attach();
  }

  void hear(const EyeCommand& message, std::uint64_t period) noexcept {
    if (message.kind == EyeMessageKind::kSafeOff) safe_off_ = true;
    if (message.kind == EyeMessageKind::kBegin) begin_ = message.period;
    if (message.kind == EyeMessageKind::kLockstep) {
      set_lockstep(true);
      lockstep_told_ = false;
    }
    if (message.kind == EyeMessageKind::kGrant) granted_ = std::max(granted_, message.period);
    if (message.kind == EyeMessageKind::kCommand && client_.orders == nullptr) {
      take_in({.token = message.token, .period = message.period, .power = message.power},
              message.period % commands_.size(), period);
    }
  }

  struct Command {
    std::uint64_t token = 0;
    std::uint64_t period = 0;
    double power = 0.0;
    bool valid = false;
  };

  /// Processes a new command. Valid for the previous, the current or the next period; others are
  /// ignored and do not feed the watchdog.
  void take_in(Command command, std::size_t slot, std::uint64_t running) noexcept {
    command.valid = command.period <= running + 1 && command.period + 1 >= running;
    seen_ = std::max(seen_, command.token);
    if (command.valid) ++tokens_;
    if (!eye_.takes(command.power)) {
      ++statistics_.refused;
      shared_.refused.fetch_add(1, std::memory_order_relaxed);
    }
    commands_[slot] = command;
  }

  /// Takes the newest unused command for this period or the one before.
  void take_command(std::uint64_t period, EyeOrders& orders) noexcept {
    if (client_.socket < 0) return;
    for (const Command& command : commands_) {
      if (!command.valid || command.period > period || command.period < taken_) continue;
      taken_ = command.period;
      ordered_ = command.power;
      orders.power = command.power;
      orders.take = true;
    }
  }

  void leave() noexcept {
    if (client_.socket < 0) return;
    close(client_.socket);
    client_ = {};
    ordered_ = 0.0;
    set_lockstep(false);
    eye_.dark();
    shared_.attached.store(false);
    done_ = done_ || options_.once;
  }

  EyeSharedState& shared_;
  EyeSharedMemory& memory_;
  PulsedEye& eye_;
  const EyeServerOptions& options_;
  const std::atomic<bool>& stop_;
  EyeStatistics& statistics_;
  std::int64_t start_ns_;  // when pulse 0 was due; in lockstep the origin of virtual time
  EyeClient client_;
  std::array<Command, 4> commands_{};
  std::uint64_t tokens_ = 0;
  std::uint64_t seen_ = 0;
  std::uint64_t taken_ = 0;
  std::uint64_t granted_ = 0;
  std::uint64_t begin_ = UINT64_MAX;
  double ordered_ = 0.0;
  bool safe_off_ = false;
  bool lockstep_ = false;
  bool lockstep_told_ = false;
  bool left_lockstep_ = false;
  bool done_ = false;
};

}  // namespace

EyeStatistics serve_eye(const EyeServerOptions& options, PulsedEye& eye, FaultScript& faults,
                        double pulse_period, const std::atomic<bool>& stop) {
  EyeSharedState shared;
  shared.pulse_ns = static_cast<std::int64_t>(std::llround(pulse_period * 1e9));
  shared.states = eye.states();
  shared.power_max = eye.power_max();
  const Listener listener(options.socket);
  const Mapped<EyeSharedMemory> memory =
      make_sealed<EyeSharedMemory>(Access::kRead, shared.descriptor);
  shared.memory = memory.get();
  memory->magic = kEyeMagic;
  memory->size = sizeof(EyeSharedMemory);
  EyeStatistics statistics;
  statistics.power_max = shared.power_max;
  std::atomic<bool> ready{false};
  std::thread pulses([&] {
    prctl(PR_SET_TIMERSLACK, 1UL);  // without SCHED_FIFO the kernel would add 50 us to each sleep
    const RealTime granted = request_real_time();
    statistics.scheduling = granted.describe();
    shared.priority.store(granted.fifo_priority);
    keep_off_core(options.foreign_core);
    memory->start_ns = monotonic_ns() + 1'000'000;
    ready.store(true, std::memory_order_release);
    Pulses(shared, eye, options, stop, statistics).run();
  });
  while (!ready.load(std::memory_order_acquire)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::thread socket_server([&] { EyeSocketServer(shared, faults, listener).run(); });
  pulses.join();
  shared.end.store(true);
  socket_server.join();
  close(shared.descriptor);
  return statistics;
}

}  // namespace photocoag
