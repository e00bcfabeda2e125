#include "photocoag/rt/eye_device.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/eye_socket.hpp"

namespace photocoag {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kAnswerWithin = 5000;  // ms, of the handshake

[[noreturn]] void refuse(const std::string& socket, const std::string& problem,
                         const std::string& accepted) {
  throw Error(ErrorParts{.where = "eye " + socket, .problem = problem, .accepted = accepted});
}

EyeSharedMemory* map(int descriptor) noexcept {
  void* memory = mmap(nullptr, sizeof(EyeSharedMemory), PROT_READ | PROT_WRITE,
                      descriptor < 0 ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_SHARED, descriptor, 0);
  if (descriptor >= 0) close(descriptor);
  return memory == MAP_FAILED ? nullptr : static_cast<EyeSharedMemory*>(memory);
}

/// Without rounding where there is nothing to average: a replay compares bits.
class PeriodMean {
 public:
  void add(double value) noexcept {
    if (count_ == 0) first_ = value;
    constant_ = constant_ && value == first_;
    sum_ += value;
    ++count_;
  }
  double value() const noexcept { return constant_ ? first_ : sum_ / count_; }

 private:
  double first_ = kNaN;
  double sum_ = 0.0;
  int count_ = 0;
  bool constant_ = true;
};

}  // namespace

EyeDevice::EyeDevice(const EyeLinkSettings& settings) : settings_(settings) {
  socket_ = connect_to(settings.socket);
  std::array<char, 512> answer{};
  EyeWelcome welcome;
  int descriptor = -1;
  // The eye must know the pulses per period, we learn its pulse period first: ask.
  const std::string status = "pulse-period";
  send_message(socket_, status.data(), status.size());
  long got = receive_message(socket_, answer.data(), answer.size() - 1, kAnswerWithin);
  pulse_ns_ = got > 0 ? std::strtoll(answer.data(), nullptr, 10) : 0;
  const auto period_ns = static_cast<std::int64_t>(std::llround(settings.period * 1e9));
  if (pulse_ns_ <= 0 || period_ns % pulse_ns_ != 0) {
    close(socket_);
    refuse(settings.socket, fmt::format("it pulses every {} ns", pulse_ns_),
           fmt::format("a whole fraction of the control period, {} ns", period_ns));
  }
  per_period_ = static_cast<std::uint64_t>(period_ns / pulse_ns_);
  const EyeHello hello{.pulses_per_period = static_cast<std::uint32_t>(per_period_),
                       .transport = settings.transport};
  send_message(socket_, &hello, sizeof(hello));
  got = receive_message(socket_, answer.data(), answer.size() - 1, kAnswerWithin, &descriptor);
  if (got >= static_cast<long>(sizeof(welcome))) {
    std::memcpy(&welcome, answer.data(), sizeof(welcome));
  }
  const bool welcomed = got == static_cast<long>(sizeof(welcome)) && welcome.magic == kEyeMagic &&
                        welcome.kind == EyeMessageKind::kWelcome;
  const bool shared = settings.transport == EyeTransport::kSharedMemory;
  if (welcomed && shared == (descriptor >= 0)) memory_ = map(descriptor);
  const bool same =
      memory_ != nullptr &&
      (!shared || (memory_->magic == kEyeMagic && memory_->size == sizeof(EyeSharedMemory)));
  if (!same) {
    close(socket_);
    refuse(settings.socket, "another controller is attached, or it is no eye",
           "one controller at a time, and the same version");
  }
  start_ns_ = welcome.start_ns;
  states_ = welcome.states;
  written_ = seen_before_ = welcome.tokens;
}

EyeDevice::~EyeDevice() {
  for (int i = 0; i < 2; ++i) write_power(0.0, 0);
  close(socket_);  // the eye goes dark at the latest now
  munmap(memory_, sizeof(EyeSharedMemory));
}

std::int64_t EyeDevice::due_ns(std::uint64_t pulse) const noexcept {
  return start_ns_ + static_cast<std::int64_t>(pulse) * pulse_ns_;
}

// Takes in what has come through the socket: in shared memory nothing but its end.
bool EyeDevice::pump() noexcept {
  alignas(8) std::array<std::byte, sizeof(PulseRecord)> message;
  for (int i = 0; i < 64 && !gone_; ++i) {
    const long got = receive_message(socket_, message.data(), message.size(), 0);
    if (got == 0) gone_ = true;
    if (got <= 0) break;
    if (settings_.transport == EyeTransport::kSharedMemory) continue;
    if (got == static_cast<long>(sizeof(PulseRecord))) {
      PulseRecord record;
      std::memcpy(&record, message.data(), sizeof(record));
      memory_->records[record.number % kEyeRing] = record;
      memory_->pulses.store(record.number + 1, std::memory_order_relaxed);
    } else if (got == static_cast<long>(sizeof(PulseTruth))) {
      PulseTruth truth;
      std::memcpy(&truth, message.data(), sizeof(truth));
      memory_->truth[truth.number % kEyeRing] = truth;
      memory_->truths.store(truth.number + 1, std::memory_order_relaxed);
    }
  }
  if (settings_.transport == EyeTransport::kSharedMemory && memory_->gone.load() != 0) gone_ = true;
  return !gone_;
}

bool EyeDevice::wait_for(std::uint64_t pulses, std::int64_t deadline_ns) noexcept {
  constexpr std::int64_t kLook = 3'000;  // ns
  wait_until(std::min(due_ns(pulses - 1), deadline_ns));
  for (;;) {
    const bool there = pump();
    if (memory_->pulses.load(std::memory_order_acquire) >= pulses) return true;
    const std::int64_t now = monotonic_ns();
    if (!there || now >= deadline_ns) return false;
    // Close to the pulse look often; one that is long overdue needs no haste.
    wait_until(now + (now - due_ns(pulses - 1) < 10 * pulse_ns_ ? kLook : 20 * kLook));
  }
}

bool EyeDevice::record(std::uint64_t number, PulseRecord& out) const noexcept {
  const std::uint64_t published = memory_->pulses.load(std::memory_order_acquire);
  if (number >= published || number + kEyeRing - 8 < published) return false;
  out = memory_->records[number % kEyeRing];
  std::atomic_thread_fence(std::memory_order_acquire);
  // Overwritten while it was copied?
  return number + kEyeRing - 8 >= memory_->pulses.load(std::memory_order_relaxed) &&
         out.number == number;
}

Baseline EyeDevice::prepare(const GrueneisenCurve& curve, const ThermometerSettings& settings,
                            int pulses) {
  std::vector<PulseReading> readings;
  constexpr std::int64_t kPatience = 2'000'000'000;  // ns beyond their time
  const std::int64_t give_up = monotonic_ns() + kPatience;
  while (pump() && memory_->pulses.load() == 0 && monotonic_ns() < give_up) {
    wait_until(monotonic_ns() + pulse_ns_);
  }
  std::uint64_t next = memory_->pulses.load(std::memory_order_acquire);
  for (int i = 0; i < pulses; ++i, ++next) {
    PulseRecord pulse;
    if (!wait_for(next + 1, due_ns(next) + kPatience) || !record(next, pulse)) {
      refuse(settings_.socket, "it does not pulse", "a pulse in each pulse period");
    }
    readings.push_back(pulse.reading);
  }
  const Baseline baseline = measure_baseline(readings, settings);
  thermometer_.emplace(baseline, curve, settings);
  hottest_ = curve.high() - settings.ambient_celsius;
  return baseline;
}

void EyeDevice::begin(std::size_t cycles) {
  truth_.clear();
  truth_.reserve(cycles);
  delivered_ = 0;
  readback_ = {};
  pump();
  const std::uint64_t now = memory_->pulses.load(std::memory_order_acquire);
  first_ = now / per_period_ + 2;
  if (cycles > 0) {
    const EyeCommand begin{.kind = EyeMessageKind::kBegin, .period = first_};
    send_message(socket_, &begin, sizeof(begin));
  }
  constexpr std::int64_t kPatience = 1'000'000'000;  // ns
  wait_for(first_ * per_period_, due_ns(first_ * per_period_) + kPatience);
}

// One control period from its pulses, in the order of time.
void EyeDevice::read_period(std::uint64_t first) noexcept {
  PeriodMean power;
  PeriodMean command;
  std::uint32_t flags = 0;
  std::uint64_t sum = 0;
  for (std::uint64_t p = first; p < first + per_period_; ++p) {
    PulseRecord pulse;
    if (!record(p, pulse)) {
      power.add(kNaN);
      command.add(kNaN);
      continue;
    }
    power.add(pulse.power_readback);
    command.add(pulse.period_power);
    flags |= pulse.flags;
    late_ += (pulse.flags & kEyeLate) != 0 ? 1 : 0;
    if (thermometer_) thermometer_->add(pulse.reading);
    for (const std::int16_t code : pulse.reading.transient.codes) {
      sum = sum * 31 + static_cast<std::uint16_t>(code);
    }
    seen_before_ = pulse.tokens;
  }
  if (thermometer_) last_ = thermometer_->finish();
  readback_ = {.power = power.value(),
               .command = command.value(),
               .interlock_closed = (flags & kEyeInterlock) == 0,
               .shutter_open = (flags & kEyeShutter) == 0,
               .foot_switch = (flags & kEyeFootSwitch) == 0};
  raw_ = static_cast<std::int64_t>(sum);
}

void EyeDevice::keep_truth(std::uint64_t period) noexcept {
  if (truth_.size() >= truth_.capacity()) return;
  PeriodTruth truth{.outputs = {.volume = kNaN, .peak = kNaN}, .peak_pulse = 0.0};
  const std::uint64_t end = (period + 1) * per_period_;
  if (end <= memory_->truths.load(std::memory_order_acquire) &&
      end - per_period_ + kEyeRing > memory_->truths.load(std::memory_order_acquire) + 8) {
    for (std::uint64_t p = end - per_period_; p < end; ++p) {
      const PulseTruth& pulse = memory_->truth[p % kEyeRing];
      truth.peak_pulse = std::max(truth.peak_pulse, pulse.peak_pulse);
      truth.outputs = {.volume = pulse.volume_mean, .peak = pulse.peak_mean};
    }
  }
  truth_.push_back(truth);
}

const std::vector<PeriodTruth>& EyeDevice::finish_truth() noexcept {
  const std::uint64_t last = first_ + delivered_;  // one beyond
  const std::int64_t deadline = monotonic_ns() + 100'000'000;
  while (memory_->truths.load(std::memory_order_acquire) < last * per_period_ && pump() &&
         monotonic_ns() < deadline) {
    wait_until(monotonic_ns() + pulse_ns_);
  }
  while (truth_.size() < delivered_ && truth_.size() < truth_.capacity()) {
    keep_truth(first_ + truth_.size());
  }
  return truth_;
}

// An answer that comes too late for the power of its period is history, whether the next one is
// there already or not: a power that misses many pulses would not be the one that was decided.
std::uint64_t EyeDevice::periods_too_late(std::int64_t age_ns) const noexcept {
  const auto period_ns = static_cast<std::int64_t>(per_period_) * pulse_ns_;
  const std::int64_t missed_pulses = per_period_ > 1 ? period_ns / 5 : 0;
  const std::int64_t slack =
      std::min(period_ns * 7 / 5, pulse_ns_ + missed_pulses + settings_.delay * period_ns);
  return age_ns <= slack ? 0 : 1 + static_cast<std::uint64_t>((age_ns - slack) / period_ns);
}

DeviceSample EyeDevice::wait_sample(std::uint64_t) noexcept {
  const std::uint64_t period = first_ + delivered_;
  const std::uint64_t end = (period + 1) * per_period_;
  const auto patience =
      static_cast<std::int64_t>(settings_.patience * static_cast<double>(per_period_)) * pulse_ns_;
  const bool there = wait_for(end, due_ns(end - 1) + patience);
  // Its truth is complete by now.
  if (delivered_ > 0) keep_truth(period - 1);
  DeviceSample sample;
  sample.sequence = ++delivered_;
  sample.time_ns = due_ns(end - 1);
  if (!there) {
    sample.status = gone_ ? DeviceStatus::kGone : DeviceStatus::kTimeout;
    sample.now_ns = monotonic_ns();
    readback_.power = readback_.command = kNaN;
    return sample;
  }
  sample.status = DeviceStatus::kGood;
  read_period(end - per_period_);
  PulseRecord last;
  if (record(end - 1, last)) sample.time_ns = last.time_ns;
  sample.raw = raw_;
  sample.now_ns = monotonic_ns();
  const std::uint64_t published = memory_->pulses.load(std::memory_order_acquire);
  const std::uint64_t old = periods_too_late(sample.now_ns - due_ns(end - 1));
  sample.periods_behind = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(std::max((published - end) / per_period_, old), 1'000'000));
  if (sample.periods_behind == 0) {
    sample.volume_temperature = last_.volume_temperature;
    sample.saturated = 2 * last_.saturated > static_cast<int>(per_period_);
    // There was a sample, at the rail: not the same as none.
    if (sample.saturated) sample.volume_temperature = hottest_;
  }
  return sample;
}

DeviceStatus EyeDevice::write_power(double power, std::uint64_t) noexcept {
  const std::uint64_t period = first_ + delivered_ + static_cast<std::uint64_t>(settings_.delay);
  ++written_;
  if (settings_.transport == EyeTransport::kSharedMemory) {
    EyeSharedMemory::Command& slot = memory_->commands[period % memory_->commands.size()];
    slot.period.store(0, std::memory_order_release);  // no half of one with half of another
    slot.power.store(power, std::memory_order_release);
    slot.period.store(period + 1, std::memory_order_release);
    memory_->tokens.fetch_add(1, std::memory_order_release);
  } else {
    const EyeCommand command{.period = period, .power = power};
    if (!send_message(socket_, &command, sizeof(command))) return DeviceStatus::kGone;
  }
  // Commands are seen within a pulse; more than two unseen at the end of a period are lost.
  return written_ - seen_before_ > 3 && delivered_ > 3 ? DeviceStatus::kTimeout
                                                       : DeviceStatus::kGood;
}

void EyeDevice::safe_off() noexcept {
  if (settings_.transport == EyeTransport::kSharedMemory) {
    memory_->safe_off.store(1, std::memory_order_release);
  } else {
    const EyeCommand off{.kind = EyeMessageKind::kSafeOff};
    send_message(socket_, &off, sizeof(off));
  }
}

std::string tell_eye(const std::string& socket, const std::string& text) {
  const int connection = connect_to(socket);
  send_message(connection, text.data(), text.size());
  std::string answer(4096, '\0');
  const long got = receive_message(connection, answer.data(), answer.size(), kAnswerWithin);
  close(connection);
  if (got <= 0) refuse(socket, "it does not answer", "an eye that runs");
  answer.resize(static_cast<std::size_t>(got));
  return answer;
}

const EyeSharedMemory& observe_eye(const std::string& socket) {
  const int connection = connect_to(socket);
  const std::string text = "observe";
  send_message(connection, text.data(), text.size());
  std::array<char, 64> answer{};
  int descriptor = -1;
  receive_message(connection, answer.data(), answer.size(), kAnswerWithin, &descriptor);
  close(connection);
  const EyeSharedMemory* memory = descriptor >= 0 ? map(descriptor) : nullptr;
  if (memory == nullptr) refuse(socket, "it cannot be observed", "an eye that runs");
  return *memory;
}

}  // namespace photocoag
