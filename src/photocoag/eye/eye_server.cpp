#include "photocoag/eye/eye_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/eye_socket.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {
namespace {

/// A controller that has been welcomed; handed from the socket thread to the pulse thread.
struct Client {
  int socket = -1;
  EyeTransport transport = EyeTransport::kSharedMemory;
  std::uint32_t pulses_per_period = 1;
};

/// What both threads know.
struct Shared {
  EyeSharedMemory* memory = nullptr;
  int descriptor = -1;
  std::int64_t pulse_ns = 0;
  std::uint64_t states = 0;
  std::atomic<bool> attached{false};  // a client is there or on its way
  std::atomic<Client*> arriving{nullptr};
  std::atomic<bool> cold{false};
  std::atomic<bool> end{false};
  std::atomic<std::uint64_t> tokens{0};
  // For the "status" line.
  std::atomic<std::uint64_t> late{0};
  std::atomic<std::uint64_t> watchdog{0};
  std::atomic<std::uint64_t> lit{0};  // pulses with light
  std::atomic<double> work_p50{0.0};
  std::atomic<double> work_p99{0.0};
  std::atomic<double> work_max{0.0};
};

/// The socket thread: welcomes one controller at a time, answers lines of text.
class Reception {
 public:
  Reception(Shared& shared, FaultScript& faults, int listener)
      : shared_(shared), faults_(faults), listener_(listener) {}

  void run() {
    constexpr int kLook = 20;  // ms
    while (!shared_.end.load()) {
      std::vector<pollfd> waits = {{.fd = listener_, .events = POLLIN, .revents = 0}};
      for (const int guest : guests_)
        waits.push_back({.fd = guest, .events = POLLIN, .revents = 0});
      if (poll(waits.data(), waits.size(), kLook) <= 0) continue;
      if (waits[0].revents != 0) {
        const int guest = accept4(listener_);
        if (guest >= 0) guests_.push_back(guest);
      }
      for (std::size_t i = 1; i < waits.size(); ++i) {
        if (waits[i].revents != 0) serve(waits[i].fd);
      }
    }
    for (const int guest : guests_) close(guest);
  }

 private:
  static int accept4(int listener);
  void drop(int guest, bool closing) {
    guests_.erase(std::find(guests_.begin(), guests_.end(), guest));
    if (closing) close(guest);
  }
  void say(int guest, const std::string& text) { send_message(guest, text.data(), text.size()); }

  void serve(int guest) {
    std::array<char, 1024> message{};
    const long got = receive_message(guest, message.data(), message.size(), 0);
    if (got < 0) return;
    if (got == 0) return drop(guest, true);
    EyeHello hello;
    if (got == static_cast<long>(sizeof(hello))) {
      std::memcpy(&hello, message.data(), sizeof(hello));
      if (hello.kind == EyeMessageKind::kHello) return welcome(guest, hello);
    }
    say_answer(guest, std::string(message.data(), static_cast<std::size_t>(got)));
  }

  void welcome(int guest, const EyeHello& hello) {
    const bool good = hello.magic == kEyeMagic && hello.pulses_per_period >= 1 &&
                      hello.pulses_per_period <= 1000 && !shared_.attached.exchange(true);
    if (!good) {
      say(guest, "refused: another controller is attached, or another version");
      return drop(guest, true);
    }
    const EyeWelcome welcome{.start_ns = shared_.memory->start_ns,
                             .pulse_period_ns = shared_.pulse_ns,
                             .states = shared_.states,
                             .tokens = shared_.tokens.load()};
    const bool memory = hello.transport == EyeTransport::kSharedMemory;
    send_message(guest, &welcome, sizeof(welcome), memory ? shared_.descriptor : -1);
    drop(guest, false);
    client_ = {guest, hello.transport, hello.pulses_per_period};
    shared_.arriving.store(&client_, std::memory_order_release);
  }

  void say_answer(int guest, const std::string& text) {
    if (text == "pulse-period") return say(guest, fmt::format("{}", shared_.pulse_ns));
    if (text == "observe") {
      send_message(guest, "memory", 6, shared_.descriptor);
      return;
    }
    if (text == "cold") {
      shared_.cold.store(true);
      return say(guest, "ok");
    }
    if (text == "status") {
      return say(guest, fmt::format("pulses={} late={} watchdog={} lit={} attached={} "
                                    "work_p50_us={:g} work_p99_us={:g} work_max_us={:.1f}",
                                    shared_.memory->pulses.load(), shared_.late.load(),
                                    shared_.watchdog.load(), shared_.lit.load(),
                                    shared_.attached.load() ? 1 : 0, shared_.work_p50.load(),
                                    shared_.work_p99.load(), shared_.work_max.load()));
    }
    constexpr std::string_view kFault = "fault ";
    try {
      if (!text.starts_with(kFault)) {
        throw Error(ErrorParts{.problem = "no such command",
                               .found = text.substr(0, 80),
                               .accepted = "status, cold, fault ID@cycle"});
      }
      if (!faults_.add(parse_fault(text.substr(kFault.size()), "fault"))) {
        return say(guest, "refused: too many faults");
      }
      say(guest, "ok");
    } catch (const Error& error) {
      say(guest, std::string("refused: ") + error.what());
    }
  }

  Shared& shared_;
  FaultScript& faults_;
  int listener_;
  std::vector<int> guests_;
  Client client_;
};

int Reception::accept4(int listener) { return ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC); }

/// The pulse thread.
class Pulses {
 public:
  Pulses(Shared& shared, PulsedEye& eye, const EyeServerOptions& options,
         const std::atomic<bool>& stop, EyeStatistics& statistics)
      : shared_(shared),
        memory_(*shared.memory),
        eye_(eye),
        options_(options),
        stop_(stop),
        statistics_(statistics) {}

  void run() noexcept {
    std::int64_t due = memory_.start_ns;
    for (std::uint64_t number = 0; !stop_.load(std::memory_order_relaxed) &&
                                   !shared_.end.load(std::memory_order_relaxed) && !done_;
         ++number) {
      wait_until(due);
      pulse(number, due);
      due += shared_.pulse_ns;
    }
    memory_.gone.store(1);
    leave();
  }

 private:
  void pulse(std::uint64_t number, std::int64_t due) noexcept {
    const std::int64_t begin = monotonic_ns();
    attend();
    EyeOrders orders{.tokens = tokens_,
                     .safe_off = safe_off_,
                     .pulses_per_period = static_cast<int>(client_.pulses_per_period),
                     .begin = begin_};
    take_command(number / client_.pulses_per_period, orders);
    PulseRecord& record = memory_.records[number % kEyeRing];
    eye_.fire(number, due, orders, record);
    if (eye_.late_ms() > 0.0) {
      wait_until(monotonic_ns() + static_cast<std::int64_t>(eye_.late_ms() * 1e6));
    }
    if (eye_.vanished()) {
      done_ = true;
      return;
    }
    record.answered_ns = monotonic_ns();
    const bool late = record.answered_ns > due + shared_.pulse_ns;
    if (late) record.flags |= kEyeLate;
    memory_.pulses.store(number + 1, std::memory_order_release);
    const bool by_socket = client_.socket >= 0 && client_.transport == EyeTransport::kSocket;
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
    s.answer.add(record.answered_ns - due);
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

  /// Controllers that come and go, and their messages.
  void attend() noexcept {
    if (shared_.cold.exchange(false)) eye_.cool();
    if (client_.socket < 0) {
      Client* arriving = shared_.arriving.exchange(nullptr, std::memory_order_acquire);
      if (arriving == nullptr) return;
      client_ = *arriving;
      safe_off_ = false;
      begin_ = UINT64_MAX;
      ordered_ = 0.0;
      taken_ = 0;
      shared_tokens_ = memory_.tokens.load();
      memory_.safe_off.store(0);
      for (auto& slot : memory_.commands) slot.period.store(0);
      for (EyeCommand& slot : received_) slot.kind = EyeMessageKind::kHello;
      eye_.attach();
    }
    EyeCommand command;
    for (int i = 0; i < 8; ++i) {
      const long got = receive_message(client_.socket, &command, sizeof(command), 0);
      if (got < 0) break;
      if (got == 0) return leave();
      if (command.kind == EyeMessageKind::kSafeOff) safe_off_ = true;
      if (command.kind == EyeMessageKind::kBegin) begin_ = command.period;
      if (command.kind == EyeMessageKind::kCommand && got == static_cast<long>(sizeof(command))) {
        received_[command.period % received_.size()] = command;
        ++tokens_;
      }
    }
    const std::uint64_t now = memory_.tokens.load(std::memory_order_acquire);
    tokens_ += now - shared_tokens_;
    shared_tokens_ = now;
    if (memory_.safe_off.load(std::memory_order_relaxed) != 0) safe_off_ = true;
    shared_.tokens.store(tokens_, std::memory_order_relaxed);
  }

  /// The newest command for this period or one before that was not taken yet.
  void take_command(std::uint64_t period, EyeOrders& orders) noexcept {
    if (client_.socket < 0) return;
    const auto consider = [&](std::uint64_t of, double power) {
      if (of > period || of < taken_) return;
      taken_ = of;
      ordered_ = power;
      orders.power = power;
      orders.take = true;
    };
    if (client_.transport == EyeTransport::kSharedMemory) {
      for (const auto& slot : memory_.commands) {
        const std::uint64_t before = slot.period.load(std::memory_order_acquire);
        const double power = slot.power.load(std::memory_order_acquire);
        if (before != 0 && slot.period.load(std::memory_order_acquire) == before) {
          consider(before - 1, power);
        }
      }
    } else {
      for (const EyeCommand& slot : received_) {
        if (slot.kind == EyeMessageKind::kCommand) consider(slot.period, slot.power);
      }
    }
  }

  void leave() noexcept {
    if (client_.socket < 0) return;
    close(client_.socket);
    client_ = {};
    ordered_ = 0.0;
    eye_.dark();
    shared_.attached.store(false);
    done_ = done_ || options_.once;
  }

  Shared& shared_;
  EyeSharedMemory& memory_;
  PulsedEye& eye_;
  const EyeServerOptions& options_;
  const std::atomic<bool>& stop_;
  EyeStatistics& statistics_;
  Client client_;
  std::array<EyeCommand, 4> received_{};
  std::uint64_t tokens_ = 0;
  std::uint64_t shared_tokens_ = 0;
  std::uint64_t taken_ = 0;
  std::uint64_t begin_ = UINT64_MAX;
  double ordered_ = 0.0;
  bool safe_off_ = false;
  bool done_ = false;
};

}  // namespace

EyeStatistics serve_eye(const EyeServerOptions& options, PulsedEye& eye, FaultScript& faults,
                        double pulse_period, const std::atomic<bool>& stop) {
  Shared shared;
  shared.pulse_ns = static_cast<std::int64_t>(std::llround(pulse_period * 1e9));
  shared.states = eye.states();
  shared.descriptor = memfd_create("photocoag-eye", MFD_CLOEXEC);
  if (shared.descriptor < 0 || ftruncate(shared.descriptor, sizeof(EyeSharedMemory)) != 0) {
    throw Error("the eye's shared memory cannot be made");
  }
  void* mapping = mmap(nullptr, sizeof(EyeSharedMemory), PROT_READ | PROT_WRITE, MAP_SHARED,
                       shared.descriptor, 0);
  if (mapping == MAP_FAILED) throw Error("the eye's shared memory cannot be mapped");
  shared.memory = static_cast<EyeSharedMemory*>(mapping);
  shared.memory->magic = kEyeMagic;
  shared.memory->size = sizeof(EyeSharedMemory);
  EyeStatistics statistics;
  std::atomic<bool> ready{false};
  std::thread pulses([&] {
    prctl(PR_SET_TIMERSLACK, 1UL);  // without SCHED_FIFO the kernel would add 50 us to each sleep
    statistics.scheduling = request_real_time().describe();
    keep_off_core(options.foreign_core);
    shared.memory->start_ns = monotonic_ns() + 1'000'000;
    ready.store(true, std::memory_order_release);
    Pulses(shared, eye, options, stop, statistics).run();
  });
  while (!ready.load(std::memory_order_acquire)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  int listener = -1;
  std::thread reception;
  try {
    listener = listen_on(options.socket);
    reception = std::thread([&] { Reception(shared, faults, listener).run(); });
  } catch (...) {
    shared.end.store(true);
    pulses.join();
    throw;
  }
  pulses.join();
  shared.end.store(true);
  reception.join();
  close(listener);
  unlink(options.socket.c_str());
  close(shared.descriptor);
  munmap(mapping, sizeof(EyeSharedMemory));
  return statistics;
}

}  // namespace photocoag
