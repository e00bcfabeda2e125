#include "photocoag/rt/eye_device.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kPatience = 2'000'000'000;  // ns, outside the loop

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

EyeDevice::EyeDevice(const EyeLinkSettings& settings)
    : settings_(settings),
      link_(settings.socket, settings.transport, std::llround(settings.period * 1e9)),
      pulse_ns_(link_.welcome().pulse_period_ns),
      per_period_(link_.pulses_per_period()) {}

EyeDevice::~EyeDevice() {
  for (int i = 0; i < 2; ++i) write_power(0.0, 0);
}

void EyeDevice::follow_in_lockstep() {
  if (!link_.lockstep()) {
    throw Error(ErrorParts{.where = "eye " + settings_.socket,
                           .problem = "it does not run in lockstep",
                           .accepted = "an eye that answers"});
  }
  lockstep_ = true;
}

std::int64_t EyeDevice::due_ns(std::uint64_t pulse) const noexcept {
  return link_.welcome().start_ns + static_cast<std::int64_t>(pulse) * pulse_ns_;
}

// The eye fires what it is granted. Grants are small: a socket holds about a hundred messages.
bool EyeDevice::wait_for_granted(std::uint64_t pulses) noexcept {
  constexpr std::uint64_t kAhead = 32;
  constexpr std::int64_t kPollNs = 20'000;  // ns
  const auto patience = static_cast<std::int64_t>(settings_.lockstep_patience * 1e9);
  std::int64_t give_up = monotonic_ns() + patience;
  std::uint64_t before = link_.pulses();
  for (;;) {
    link_.grant(std::min(pulses, before + kAhead));
    const bool there = link_.pump();
    const std::uint64_t published = link_.pulses();
    if (published >= pulses) return true;
    const std::int64_t now = monotonic_ns();
    if (!there || now >= give_up) return false;
    if (published != before) give_up = now + patience;
    before = published;
    wait_until(now + kPollNs);
  }
}

// Until `pulses` are there, at most `patience_ns` beyond their time.
bool EyeDevice::wait_for(std::uint64_t pulses, std::int64_t patience_ns) noexcept {
  if (lockstep_) return wait_for_granted(pulses);
  constexpr std::int64_t kPollNs = 3'000;  // ns
  // Never waits for more than a few periods ahead, whatever the eye reports.
  const std::int64_t ahead = 4 * static_cast<std::int64_t>(per_period_) * pulse_ns_;
  const std::int64_t due = std::min(due_ns(pulses - 1), monotonic_ns() + ahead);
  const std::int64_t deadline = due + patience_ns;
  wait_until(due);
  for (;;) {
    const bool there = link_.pump();
    if (link_.pulses() >= pulses) return true;
    const std::int64_t now = monotonic_ns();
    if (!there || now >= deadline) return false;
    // Poll often near the due time, less often once the pulse is long overdue.
    wait_until(now + (now - due < 10 * pulse_ns_ ? kPollNs : 20 * kPollNs));
  }
}

Baseline EyeDevice::prepare(const GrueneisenCurve& curve, const ThermometerSettings& settings,
                            int pulses) {
  std::vector<PulseReading> readings;
  int late = 0;
  const std::int64_t give_up = monotonic_ns() + kPatience;
  while (link_.pump() && link_.pulses() == 0 && !lockstep_ && monotonic_ns() < give_up) {
    wait_until(monotonic_ns() + pulse_ns_);
  }
  std::uint64_t next = link_.pulses();
  for (int i = 0; i < pulses; ++i, ++next) {
    PulseRecord pulse;
    if (!wait_for(next + 1, kPatience) || !link_.record(next, pulse)) {
      throw Error(ErrorParts{.where = "eye " + settings_.socket,
                             .problem = "it makes no pulses",
                             .accepted = "a pulse in each pulse period"});
    }
    const bool behind = link_.pulses() > next + 1 + per_period_;
    late += (pulse.flags & kEyeLate) != 0 || behind ? 1 : 0;
    readings.push_back(pulse.reading);
  }
  late_in_baseline_ = static_cast<double>(late) / std::max(1, pulses);
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
  refused_ = false;
  link_.pump();
  first_ = link_.pulses() / per_period_ + 2;
  if (cycles > 0) link_.begin(first_);
  wait_for(first_ * per_period_, kPatience);
}

// One control period from its pulses, in the order of time.
void EyeDevice::read_period(std::uint64_t first) noexcept {
  PeriodMean power;
  PeriodMean command;
  std::uint32_t flags = 0;
  std::uint64_t sum = 0;
  for (std::uint64_t p = first; p < first + per_period_; ++p) {
    PulseRecord pulse;
    if (!link_.record(p, pulse)) {
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
  refused_ = (flags & kEyeRefused) != 0;
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
  if (end <= link_.truths() && end - per_period_ + kEyeRing > link_.truths() + 8) {
    for (std::uint64_t p = end - per_period_; p < end; ++p) {
      const PulseTruth& pulse = link_.truth(p);
      truth.peak_pulse = std::max(truth.peak_pulse, pulse.peak_pulse);
      truth.outputs = {.volume = pulse.volume_mean, .peak = pulse.peak_mean};
    }
  }
  truth_.push_back(truth);
}

const std::vector<PeriodTruth>& EyeDevice::finish_truth() noexcept {
  const std::uint64_t last = first_ + delivered_;  // one beyond
  const std::int64_t deadline = monotonic_ns() + kPatience;
  while (link_.truths() < last * per_period_ && link_.pulses() >= last * per_period_ &&
         link_.pump() && monotonic_ns() < deadline) {
    wait_until(monotonic_ns() + pulse_ns_);
  }
  while (truth_.size() < delivered_ && truth_.size() < truth_.capacity()) {
    keep_truth(first_ + truth_.size());
  }
  return truth_;
}

// An answer that comes too late for its period's power is outdated, even if the next one is not
// there yet: a power that misses many pulses would differ from the decided one.
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
  const bool there = wait_for(end, patience);
  // Its truth is complete by now.
  if (delivered_ > 0) keep_truth(period - 1);
  DeviceSample sample;
  sample.sequence = ++delivered_;
  sample.time_ns = due_ns(end - 1);
  if (!there) {
    sample.status = link_.gone() ? DeviceStatus::kGone : DeviceStatus::kTimeout;
    sample.now_ns = lockstep_ ? sample.time_ns : monotonic_ns();
    readback_.power = readback_.command = kNaN;
    return sample;
  }
  sample.status = DeviceStatus::kGood;
  read_period(end - per_period_);
  PulseRecord last;
  if (link_.record(end - 1, last)) sample.time_ns = last.time_ns;
  sample.raw = raw_;
  const std::uint64_t published = link_.pulses();
  sample.now_ns = lockstep_ ? due_ns(published - 1) : monotonic_ns();
  const std::uint64_t old = periods_too_late(sample.now_ns - due_ns(end - 1));
  sample.periods_behind = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(std::max((published - end) / per_period_, old), 1'000'000));
  if (sample.periods_behind == 0) {
    sample.volume_temperature = last_.volume_temperature;
    sample.saturated = 2 * last_.saturated > static_cast<int>(per_period_);
    // A sample at the rail is not a missing one.
    if (sample.saturated) sample.volume_temperature = hottest_;
  }
  return sample;
}

DeviceStatus EyeDevice::write_power(double power, std::uint64_t) noexcept {
  const std::uint64_t period = first_ + delivered_ + static_cast<std::uint64_t>(settings_.delay);
  if (!link_.command(period, power, ++written_)) return DeviceStatus::kGone;
  // Commands are seen within a pulse; more than two unseen at the end of a period are lost.
  const auto unseen = static_cast<std::int64_t>(written_ - seen_before_);
  return refused_ || (unseen > 3 && delivered_ > 3) ? DeviceStatus::kTimeout : DeviceStatus::kGood;
}

void EyeDevice::safe_off() noexcept { link_.safe_off(); }

}  // namespace photocoag
