#include "photocoag/rt/driver_promises.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "photocoag/device/driver.h"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/tried_driver.hpp"

namespace photocoag {
namespace {

constexpr double kNoLight = 1e-6;    // W
constexpr double kTolerance = 0.25;  // of a power that is read back

void table(const DriverCheckSettings& s) {
  const photocoag_driver_table* t = table_of(s);
  if (t->version != PHOTOCOAG_DRIVER_VERSION) {
    broken("version {} instead of {}", t->version, PHOTOCOAG_DRIVER_VERSION);
  }
  if (t->size != sizeof(photocoag_driver_table)) {
    broken("size {} instead of {}", t->size, sizeof(photocoag_driver_table));
  }
  if (t->name == nullptr || *t->name == '\0') broken("it has no name");
  if (t->simulated != 0 && t->simulated != 1) broken("simulated is {}, not 0 or 1", t->simulated);
  if (t->open == nullptr || t->arm == nullptr || t->wait_sample == nullptr ||
      t->write_power == nullptr || t->readback == nullptr || t->heartbeat == nullptr ||
      t->safe_off == nullptr || t->close == nullptr) {
    broken("an entry of the table is empty");
  }
  if (table_of(s) != t) broken("photocoag_driver() returns another table the second time");
  if (t->simulated != 1 && !s.light_allowed) {
    throw UnopenedDevice{"light can come out of this driver's device: see --light"};
  }
}

void dark_after_open(const DriverCheckSettings& s) {
  Tried device(s);
  device.sample();
  const double power = device.readback().power;
  if (!(std::abs(power) <= kNoLight)) broken("{:g} W are read back before any command", power);
  device.close();
}

void message(const DriverCheckSettings& s) {
  if (s.failing.empty()) throw NotTried{"no settings that make open fail (--failing)"};
  const photocoag_driver_table* t = table_of(s);
  for (const std::uint32_t size : {64U, 2U, 1U}) {
    std::array<char, 80> text;
    text.fill('#');
    void* device = nullptr;
    const std::int32_t answer = t->open(&device, s.failing.c_str(), text.data(), size);
    if (Tried::known(answer, "open") == PHOTOCOAG_GOOD) {
      broken("open succeeds with \"{}\"", s.failing);
    }
    const auto* end = static_cast<const char*>(std::memchr(text.data(), '\0', size));
    if (end == nullptr) broken("no zero within the {} bytes of its message", size);
    const bool beyond =
        std::any_of(text.begin() + size, text.end(), [](char c) { return c != '#'; });
    if (beyond) broken("its message of {} bytes is written beyond its end", size);
    if (size == 64 && end == text.data()) broken("open fails without a message");
  }
}

void order(const DriverCheckSettings& s) {
  Tried device(s);
  photocoag_sample last = device.sample();
  if (last.sequence != 1) broken("the first sample has the number {}, not 1", last.sequence);
  for (int k = 0; k < kTriedPeriods; ++k) {
    device.write(0.0);
    const photocoag_sample sample = device.sample();
    if (sample.sequence != last.sequence + 1) {
      broken("after sample {} comes {}", last.sequence, sample.sequence);
    }
    const std::int64_t between = sample.time_ns - last.time_ns;
    if (std::abs(between - device.period()) > device.period() / 2) {
      broken("samples {} and {} are {} ns apart, the period is {} ns", last.sequence,
             sample.sequence, between, device.period());
    }
    if (sample.time_ns > monotonic_ns()) broken("sample {} is of the future", sample.sequence);
    if (std::isinf(sample.volume_temperature)) broken("the volume temperature is infinite");
    last = sample;
  }
  device.close();
}

void late(const DriverCheckSettings& s) {
  Tried device(s);
  photocoag_sample last = device.sample();
  std::this_thread::sleep_for(std::chrono::nanoseconds(6 * device.period()));
  for (int k = 0; k < 5; ++k) {
    const photocoag_sample sample = device.sample();
    if (sample.sequence != last.sequence + 1) {
      broken("fetched late, after sample {} comes {}: a period is missing", last.sequence,
             sample.sequence);
    }
    if (std::abs(sample.time_ns - last.time_ns - device.period()) > device.period() / 2) {
      broken("fetched late, a sample has not the time when it was taken");
    }
    last = sample;
  }
  device.close();
}

void deadline(const DriverCheckSettings& s) {
  Tried device(s);
  photocoag_sample last = device.sample();
  std::int64_t least_over = std::numeric_limits<std::int64_t>::max();
  int timeouts = 0;
  for (int k = 0; k < 100 && timeouts < 10; ++k) {
    photocoag_sample sample = last;
    const std::int64_t until = monotonic_ns() + device.period() / 20;
    const std::int32_t answer = device.wait(sample, until);
    if (answer == PHOTOCOAG_TIMEOUT) {
      ++timeouts;
      least_over = std::min(least_over, monotonic_ns() - until);
      sample = device.sample();
    } else if (monotonic_ns() < sample.time_ns) {
      broken("a sample is handed out before its time");
    }
    if (sample.sequence != last.sequence + 1) {
      broken("after a deadline that passed, sample {} is followed by {}", last.sequence,
             sample.sequence);
    }
    last = sample;
  }
  if (timeouts == 0) broken("a deadline of a twentieth of a period is never kept");
  if (least_over > device.period() / 2) {
    broken("it returns {} ns after the deadline at best", least_over);
  }
  device.close();
}

void tokens(const DriverCheckSettings& s) {
  Tried device(s);
  device.emit(0.0, 3);
  const std::uint64_t old = device.token();
  for (const std::uint64_t token : {old, old - 1}) {
    if (device.write(s.power, token) == PHOTOCOAG_GOOD) {
      broken("a power with the token {} is taken after {}", token, old);
    }
  }
  double highest = 0.0;
  device.power_after(monotonic_ns(), 2,
                     [&] { highest = std::max(highest, device.readback().power); });
  if (highest > kNoLight) broken("{:g} W come of an old command", highest);
  if (device.write(0.0) != PHOTOCOAG_GOOD) broken("a new token is refused after an old one");
  device.close();
}

void powers(const DriverCheckSettings& s) {
  Tried device(s);
  for (const double power : {std::numeric_limits<double>::quiet_NaN(), -s.power,
                             std::numeric_limits<double>::infinity()}) {
    if (device.write(power) == PHOTOCOAG_GOOD) broken("a power of {} W is taken", power);
  }
  device.close();
}

void readback(const DriverCheckSettings& s) {
  Tried device(s);
  double best = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < kTriedPeriods; ++k) {
    if (device.write(s.power) != PHOTOCOAG_GOOD) broken("write_power refuses {:g} W", s.power);
    device.sample();
    const photocoag_readback answer = device.readback();
    for (const std::int32_t bit :
         {answer.interlock_closed, answer.shutter_open, answer.foot_switch}) {
      if (bit != 0 && bit != 1) broken("a switch is {}, not 0 or 1", bit);
    }
    if (!std::isfinite(answer.power) || answer.power < -kNoLight) {
      broken("the power read back is {}", answer.power);
    }
    if (!std::isnan(answer.command) && !(answer.command >= 0.0 && answer.command <= 1.0)) {
      broken("the command read back is {}", answer.command);
    }
    if (!(std::abs(answer.power - s.power) >= std::abs(best - s.power))) best = answer.power;
  }
  if (!(std::abs(best - s.power) <= kTolerance * s.power)) {
    broken("{:g} W are commanded and {:g} W read back at best", s.power, best);
  }
  device.write(0.0);
  device.close();
}

void watchdog(const DriverCheckSettings& s) {
  Tried device(s);
  if (device.emit(s.power) <= kNoLight) throw NotTried{"no light is read back"};
  const double left = device.power_after(monotonic_ns(), 4, [] {});
  if (left > kNoLight) broken("{:g} W four periods after the last command", left);
  device.close();
}

void only_tokens_feed(const DriverCheckSettings& s) {
  Tried device(s);
  if (device.emit(s.power) <= kNoLight) throw NotTried{"no light is read back"};
  std::uint64_t cycle = 0;
  const double left = device.power_after(monotonic_ns(), 4, [&] {
    device.heartbeat(cycle++);
    device.write(s.power, device.token());  // an old one
  });
  if (left > kNoLight) broken("a heartbeat or an old token keeps {:g} W on", left);
  device.close();
}

void safe_off(const DriverCheckSettings& s) {
  Tried device(s);
  device.emit(s.power);
  device.safe_off();
  double highest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double power = device.power_after(monotonic_ns(), 2, [&] { device.write(s.power); });
    highest = std::max(highest, power);
  }
  if (highest > kNoLight) broken("{:g} W after safe_off", highest);
  if (device.readback().interlock_closed != 0) broken("the interlock is still closed");
  device.safe_off();  // twice does no harm
  device.close();
}

void reopen(const DriverCheckSettings& s) {
  for (int k = 0; k < 3; ++k) {
    try {
      Tried device(s);
      const photocoag_sample first = device.sample();
      if (first.sequence != 1) broken("opened again, samples begin with {}", first.sequence);
      if (k == 1) device.emit(s.power, 3);  // closed while it emits
      if (k == 2 && device.readback().power > kNoLight) broken("light from before close");
      device.close();
    } catch (const UnopenedDevice& unopened) {
      broken("after close it cannot be opened again: {}", unopened.why);
    }
  }
  Tried unarmed(s, false);
  unarmed.safe_off();
  unarmed.close();
}

void times(const DriverCheckSettings& s) {
  Tried device(s);
  constexpr std::array<const char*, 3> kCalls = {"write_power", "readback", "heartbeat"};
  std::array<std::vector<std::int64_t>, 3> all;
  const auto timed = [](std::vector<std::int64_t>& list, auto&& call) {
    const std::int64_t begin = monotonic_ns();
    call();
    list.push_back(monotonic_ns() - begin);
  };
  for (int k = 0; k < kTriedPeriods; ++k) {
    device.sample();
    timed(all[0], [&] { device.write(0.0); });
    timed(all[1], [&] { device.readback(); });
    timed(all[2], [&] { device.heartbeat(static_cast<std::uint64_t>(k)); });
  }
  // The fastest quarter: delays by the machine are not the driver's.
  for (std::size_t c = 0; c < all.size(); ++c) {
    std::sort(all[c].begin(), all[c].end());
    const std::int64_t quick = all[c][all[c].size() / 4];
    if (quick > device.period() / 2) {
      broken("{} takes {} ns, half a period is {} ns", kCalls[c], quick, device.period() / 2);
    }
  }
  device.close();
}

void allocation(const DriverCheckSettings& s) {
  Tried device(s);
  device.sample();
  count_allocations(device.library());
  const long before = counted_allocations();
  device.emit(0.0);
  device.heartbeat(1);
  device.safe_off();
  if (const long count = counted_allocations() - before; count > 0) {
    broken("{} allocations in {} periods after arm", count, kTriedPeriods);
  }
  device.close();
}

}  // namespace

const std::vector<Promise>& driver_promises() {
  static const std::vector<Promise> promises = {
      {"table", "version, size, name and eight functions", table},
      {"open", "opens, and is at 0 W", dark_after_open},
      {"message", "says why it does not open, within the room it is given", message},
      {"order", "samples 1, 2, … each a period after the other, with their time", order},
      {"late", "periods that are fetched late come one by one", late},
      {"deadline", "wait_sample ends at its deadline and loses no sample", deadline},
      {"tokens", "a command with an old token is no command", tokens},
      {"powers", "what is no power is refused", powers},
      {"readback", "reads back what is emitted, and its switches", readback},
      {"watchdog", "0 W without a new token for two periods", watchdog},
      {"feeding", "neither heartbeats nor old tokens feed the watchdog", only_tokens_feed},
      {"safe-off", "0 W and interlock open, whatever is written afterwards", safe_off},
      {"reopen", "can be closed at any moment and opened again", reopen},
      {"times", "calls return within half a period", times},
      {"allocation", "nothing is allocated after arm", allocation},
  };
  return promises;
}

}  // namespace photocoag
