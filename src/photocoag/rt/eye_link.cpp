#include "photocoag/rt/eye_link.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/eye_socket.hpp"

namespace photocoag {
namespace {

constexpr int kAnswerWithin = 5000;  // ms, of the handshake

[[noreturn]] void refuse_eye(const std::string& socket, const std::string& problem,
                             const std::string& accepted) {
  throw Error(ErrorParts{.where = "eye " + socket, .problem = problem, .accepted = accepted});
}

/// Closed at its end unless it is released.
class Connection {
 public:
  explicit Connection(const std::string& path) : socket_(connect_to(path)) {}
  ~Connection() {
    if (socket_ >= 0) close(socket_);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  int get() const noexcept { return socket_; }
  int release() noexcept { return std::exchange(socket_, -1); }

 private:
  int socket_;
};

template <typename Memory>
bool same_version(const Memory& memory) noexcept {
  return memory != nullptr && memory->magic == kEyeMagic &&
         memory->size == sizeof(typename Memory::element_type);
}

std::int64_t ask_pulse_period(int socket) {
  constexpr std::string_view kQuestion = "pulse-period";
  std::array<char, 64> answer{};
  send_message(socket, kQuestion.data(), kQuestion.size());
  const long got = receive_message(socket, answer.data(), answer.size(), kAnswerWithin);
  std::int64_t period = 0;
  if (got > 0) std::from_chars(answer.data(), answer.data() + got, period);
  return period;
}

// Times from an untrusted server must neither be waited for nor overflow.
bool believable(const EyeWelcome& welcome, const EyeSharedMemory& memory) noexcept {
  constexpr double kSoon = 10e9;  // ns
  constexpr double kLong = 4e18;  // ns
  const auto pulses = static_cast<double>(memory.pulses.load(std::memory_order_acquire));
  const double next =
      static_cast<double>(welcome.start_ns) + pulses * static_cast<double>(welcome.pulse_period_ns);
  return pulses < 1e15 && std::abs(static_cast<double>(welcome.start_ns)) < kLong &&
         next < static_cast<double>(monotonic_ns()) + kSoon && std::isfinite(welcome.power_max);
}

}  // namespace

EyeLink::EyeLink(const std::string& socket, EyeTransport transport, std::int64_t period_ns)
    : transport_(transport) {
  Connection connection(socket);
  // The eye must know the pulses per period, we learn its pulse period first.
  const std::int64_t pulse_ns = ask_pulse_period(connection.get());
  if (pulse_ns <= 0 || period_ns % pulse_ns != 0 ||
      period_ns / pulse_ns > std::int64_t{kMostPulsesPerPeriod}) {
    refuse_eye(socket, fmt::format("it pulses every {} ns", pulse_ns),
               fmt::format("a whole fraction of the control period, {} ns", period_ns));
  }
  per_period_ = static_cast<std::uint64_t>(period_ns / pulse_ns);
  const EyeHello hello{.pulses_per_period = static_cast<std::uint32_t>(per_period_),
                       .transport = transport};
  send_message(connection.get(), &hello, sizeof(hello));
  std::array<char, 512> answer{};
  std::array<int, 2> descriptors{};
  const long got =
      receive_message(connection.get(), answer.data(), answer.size(), kAnswerWithin, descriptors);
  seen_ = map_sealed<EyeSharedMemory>(descriptors[0], Access::kRead);
  orders_ = map_sealed<EyeOrderMemory>(descriptors[1], Access::kWrite);
  if (got == static_cast<long>(sizeof(welcome_))) {
    std::memcpy(&welcome_, answer.data(), sizeof(welcome_));
  }
  const bool shared = transport == EyeTransport::kSharedMemory;
  const bool welcomed = got == static_cast<long>(sizeof(welcome_)) && welcome_.magic == kEyeMagic &&
                        welcome_.kind == EyeMessageKind::kWelcome &&
                        welcome_.pulse_period_ns == pulse_ns;
  if (!welcomed) {
    refuse_eye(socket, "another controller is attached, or it is no eye",
               "one controller at a time, and the same version");
  }
  if (!shared) own_ = make_private<EyeSharedMemory>();
  if (shared && !(same_version(seen_) && same_version(orders_))) {
    refuse_eye(socket, "it shares no memory of an eye", "sealed memory of the same version");
  }
  memory_ = shared ? seen_.get() : own_.get();
  if (!believable(welcome_, *memory_)) {
    refuse_eye(socket, "its clock is not plausible", "an eye on this machine's monotonic clock");
  }
  socket_ = connection.release();
}

EyeLink::~EyeLink() { close(socket_); }  // the eye goes dark now at the latest

bool EyeLink::pump() noexcept {
  alignas(8) std::array<std::byte, sizeof(PulseRecord)> message;
  for (int i = 0; i < 64 && !gone_; ++i) {
    const long got = receive_message(socket_, message.data(), message.size(), 0);
    if (got == 0) gone_ = true;
    if (got == 0 || got == kNoMessage) break;
    if (got == static_cast<long>(sizeof(EyeLockstep))) {
      EyeLockstep begun;
      std::memcpy(&begun, message.data(), sizeof(begun));
      in_lockstep_ = begun.kind == EyeMessageKind::kLockstep;
      if (own_ != nullptr) own_->pulses.store(begun.pulses, std::memory_order_relaxed);
    }
    if (own_ == nullptr) continue;
    if (got == static_cast<long>(sizeof(PulseRecord))) {
      PulseRecord record;
      std::memcpy(&record, message.data(), sizeof(record));
      own_->records[record.number % kEyeRing] = record;
      own_->pulses.store(record.number + 1, std::memory_order_relaxed);
    } else if (got == static_cast<long>(sizeof(PulseTruth))) {
      PulseTruth truth;
      std::memcpy(&truth, message.data(), sizeof(truth));
      own_->truth[truth.number % kEyeRing] = truth;
      own_->truths.store(truth.number + 1, std::memory_order_relaxed);
    }
  }
  if (memory_->gone.load() != 0) gone_ = true;
  return !gone_;
}

bool EyeLink::record(std::uint64_t number, PulseRecord& out) const noexcept {
  const std::uint64_t published = pulses();
  if (number >= published || number + kEyeRing - 8 < published) return false;
  out = memory_->records[number % kEyeRing];
  std::atomic_thread_fence(std::memory_order_acquire);
  // Overwritten while it was copied?
  return number + kEyeRing - 8 >= memory_->pulses.load(std::memory_order_relaxed) &&
         out.number == number;
}

bool EyeLink::tell(EyeMessageKind kind, std::uint64_t period) noexcept {
  const EyeCommand message{.kind = kind, .period = period};
  return send_message(socket_, &message, sizeof(message));
}

bool EyeLink::command(std::uint64_t period, double power, std::uint64_t token) noexcept {
  if (orders_ == nullptr) {
    const EyeCommand message{.period = period, .power = power, .token = token};
    return send_message(socket_, &message, sizeof(message));
  }
  EyeOrderMemory::Command& slot = orders_->commands[period % orders_->commands.size()];
  slot.period.store(0, std::memory_order_release);  // no half of one with half of another
  slot.power.store(power, std::memory_order_release);
  slot.token.store(token, std::memory_order_release);
  slot.period.store(period + 1, std::memory_order_release);
  return true;
}

void EyeLink::safe_off() noexcept {
  if (orders_ != nullptr) orders_->safe_off.store(1, std::memory_order_release);
  tell(EyeMessageKind::kSafeOff, 0);
}

void EyeLink::begin(std::uint64_t period) noexcept { tell(EyeMessageKind::kBegin, period); }

bool EyeLink::lockstep() noexcept {
  constexpr std::int64_t kPollNs = 50'000;  // ns
  const std::int64_t give_up = monotonic_ns() + kAnswerWithin * std::int64_t{1'000'000};
  tell(EyeMessageKind::kLockstep, 0);
  while (pump() && !in_lockstep_ && monotonic_ns() < give_up) wait_until(monotonic_ns() + kPollNs);
  return in_lockstep_;
}

void EyeLink::grant(std::uint64_t pulses) noexcept {
  if (pulses <= granted_) return;
  granted_ = pulses;
  if (orders_ != nullptr) {
    orders_->granted.store(pulses, std::memory_order_release);
  } else {
    tell(EyeMessageKind::kGrant, pulses);
  }
}

std::string command_eye(const std::string& socket, const std::string& text) {
  const Connection connection(socket);
  send_message(connection.get(), text.data(), text.size());
  std::string answer(4096, '\0');
  const long got = receive_message(connection.get(), answer.data(), answer.size(), kAnswerWithin);
  if (got <= 0) refuse_eye(socket, "it does not answer", "an eye that runs");
  answer.resize(static_cast<std::size_t>(got));
  return answer;
}

Mapped<const EyeSharedMemory> observe_eye(const std::string& socket) {
  const Connection connection(socket);
  constexpr std::string_view kQuestion = "observe";
  send_message(connection.get(), kQuestion.data(), kQuestion.size());
  std::array<char, 64> answer{};
  std::array<int, 1> descriptor{};
  receive_message(connection.get(), answer.data(), answer.size(), kAnswerWithin, descriptor);
  Mapped<EyeSharedMemory> memory = map_sealed<EyeSharedMemory>(descriptor[0], Access::kRead);
  if (!same_version(memory)) {
    refuse_eye(socket, "it cannot be observed", "an eye that runs, of the same version");
  }
  return {memory.release(), Unmap{sizeof(EyeSharedMemory)}};
}

}  // namespace photocoag
