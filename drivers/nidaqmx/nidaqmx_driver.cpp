// Role: online; a laser and its temperature signal behind a data acquisition device of NI, as a
// driver of photocoag (device/driver.h). Tested with a stand-in for the vendor's library
// (tests/nidaqmx): UNTRIED ON HARDWARE. Research software, not a medical device.
// Source: docs/devices.md, nidaqmx.hpp. Units: V at the device, SI outside.
// Real time: after arm no allocation of ours; every call is one software-timed sample, its waiting
// bounded by half a period, as far as the vendor's library keeps that. No watchdog of the device is
// used: line `alive` changes with every new token, and a circuit outside must open the laser's
// interlock if it stops changing.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <new>

#include "nidaqmx/nidaqmx.hpp"
#include "photocoag/device/driver.h"

namespace photocoag {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr double kSlow = 1.0;         // s, for calls before arm
constexpr double kOfTheRail = 0.999;  // of the range: the converter is at its rail
constexpr std::size_t kWord = 128;
using Word = std::array<char, kWord>;

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * kNsPerSecond + t.tv_nsec;
}

void sleep_until(std::int64_t when) {
  const timespec t{.tv_sec = static_cast<std::time_t>(when / kNsPerSecond),
                   .tv_nsec = static_cast<long>(when % kNsPerSecond)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

struct Settings {
  Word library{"libnidaqmx.so.1"}, device{"Dev1"};
  Word temperature{"ai0"}, monitor{"ai1"}, power{"ao0"};
  Word interlock{"port0/line0"}, shutter{"port0/line1"}, foot{"port0/line2"};  // 1: closed, open, …
  Word relay{"port0/line3"}, alive{"port0/line4"};                             // outputs
  double K_per_V = 0, W_per_V = 0, monitor_W_per_V = 0;
  double zero_V = 0;    // of the temperature signal
  double range_V = 10;  // of inputs and output
};

struct Daq {
  Settings settings;
  void* library = nullptr;
  DaqFunctions call{};
  DaqTask inputs = nullptr, output = nullptr, switches = nullptr, lines = nullptr;
  std::int64_t period_ns = 0;
  std::int64_t next_ns = 0;
  std::int64_t last_write_ns = 0;
  std::uint64_t token = 0;
  std::uint64_t sequence = 0;
  double patience = kSlow;  // s, of one call
  std::uint8_t alive = 0;
  bool off = false;
};

Daq* self(void* device) { return static_cast<Daq*>(device); }

struct TextSetting {
  const char* name;
  Word Settings::*value;
};
constexpr TextSetting kTexts[] = {{"library", &Settings::library},
                                  {"device", &Settings::device},
                                  {"temperature", &Settings::temperature},
                                  {"monitor", &Settings::monitor},
                                  {"power", &Settings::power},
                                  {"interlock", &Settings::interlock},
                                  {"shutter", &Settings::shutter},
                                  {"foot", &Settings::foot},
                                  {"relay", &Settings::relay},
                                  {"alive", &Settings::alive}};
struct NumberSetting {
  const char* name;
  double Settings::*value;
};
constexpr NumberSetting kNumbers[] = {{"K_per_V", &Settings::K_per_V},
                                      {"W_per_V", &Settings::W_per_V},
                                      {"monitor_W_per_V", &Settings::monitor_W_per_V},
                                      {"zero_V", &Settings::zero_V},
                                      {"range_V", &Settings::range_V}};

bool take(Settings& settings, const char* name, const char* value) {
  for (const TextSetting& text : kTexts) {
    if (std::strcmp(name, text.name) != 0) continue;
    const std::size_t length = std::strlen(value);
    if (length == 0 || length >= kWord) return false;
    std::memcpy((settings.*text.value).data(), value, length + 1);
    return true;
  }
  for (const NumberSetting& number : kNumbers) {
    if (std::strcmp(name, number.name) != 0) continue;
    char* end = nullptr;
    settings.*number.value = std::strtod(value, &end);
    return end != value && *end == '\0' && std::isfinite(settings.*number.value);
  }
  return false;
}

/// "name=value name=value …"; the first word that is not understood goes into `message`.
bool read(const char* text, Settings& settings, char* message, std::uint32_t size) {
  std::array<char, 1024> words{};
  std::snprintf(words.data(), words.size(), "%s", text);
  char* rest = nullptr;
  for (char* word = strtok_r(words.data(), " \n\t", &rest); word != nullptr;
       word = strtok_r(nullptr, " \n\t", &rest)) {
    char* value = std::strchr(word, '=');
    if (value != nullptr) *value++ = '\0';
    if (value == nullptr || !take(settings, word, value)) {
      std::snprintf(message, size, "setting %s: not understood", word);
      return false;
    }
  }
  const bool scaled = settings.K_per_V != 0.0 && settings.W_per_V > 0.0 &&
                      settings.monitor_W_per_V > 0.0 && settings.range_V > 0.0;
  if (!scaled) {
    std::snprintf(message, size,
                  "K_per_V, W_per_V and monitor_W_per_V must be given: there is no default scale");
  }
  return scaled;
}

// "Dev1/ai0,Dev1/ai1"
std::array<char, 1024> joined(const Settings& s, const Word* first, const Word* second,
                              const Word* third) {
  std::array<char, 1024> list{};
  int at = 0;
  for (const Word* word : {first, second, third}) {
    if (word == nullptr) continue;
    at += std::snprintf(list.data() + at, list.size() - static_cast<std::size_t>(at), "%s%s/%s",
                        at > 0 ? "," : "", s.device.data(), word->data());
  }
  return list;
}

bool make_tasks(Daq& d) {
  const Settings& s = d.settings;
  const DaqFunctions& call = d.call;
  const auto made = [&](DaqTask& task, const char* name) {
    return call.create_task(name, &task) >= 0;
  };
  return made(d.inputs, "photocoag_inputs") &&
         call.ai_voltage(d.inputs, joined(s, &s.temperature, &s.monitor, nullptr).data(), "",
                         kDaqDefaultTerminals, -s.range_V, s.range_V, kDaqVolts, nullptr) >= 0 &&
         made(d.output, "photocoag_output") &&
         call.ao_voltage(d.output, joined(s, &s.power, nullptr, nullptr).data(), "", 0.0, s.range_V,
                         kDaqVolts, nullptr) >= 0 &&
         made(d.switches, "photocoag_switches") &&
         call.di_lines(d.switches, joined(s, &s.interlock, &s.shutter, &s.foot).data(), "",
                       kDaqOneChannelForAll) >= 0 &&
         made(d.lines, "photocoag_lines") &&
         call.do_lines(d.lines, joined(s, &s.relay, &s.alive, nullptr).data(), "",
                       kDaqOneChannelForAll) >= 0 &&
         call.start_task(d.inputs) >= 0 && call.start_task(d.output) >= 0 &&
         call.start_task(d.switches) >= 0 && call.start_task(d.lines) >= 0;
}

bool put_power(const Daq& d, double power) {
  return d.call.write_analog(d.output, 0, d.patience, power / d.settings.W_per_V, nullptr) >= 0;
}

bool put_lines(const Daq& d) {
  const std::array<std::uint8_t, 2> values = {static_cast<std::uint8_t>(d.off ? 0 : 1), d.alive};
  std::int32_t count = 0;
  return d.call.write_lines(d.lines, 1, 0, d.patience, kDaqByChannel, values.data(), &count,
                            nullptr) >= 0 &&
         count == 1;
}

struct Volts {
  double temperature = 0, monitor = 0;
};
bool get_volts(const Daq& d, Volts& volts) {
  std::array<double, 2> values{};
  std::int32_t count = 0;
  if (d.call.read_analog(d.inputs, 1, d.patience, kDaqByChannel, values.data(), values.size(),
                         &count, nullptr) < 0 ||
      count != 1) {
    return false;
  }
  volts = {values[0], values[1]};
  return true;
}

void let_go(Daq* d) {
  for (const DaqTask task : {d->inputs, d->output, d->switches, d->lines}) {
    if (task != nullptr) d->call.clear_task(task);
  }
  if (d->library != nullptr) dlclose(d->library);
  delete d;
}

std::int32_t open(void** device, const char* text, char* message, std::uint32_t size) {
  auto* d = new (std::nothrow) Daq;
  if (d == nullptr) return PHOTOCOAG_GONE;
  const auto refuse = [&] {
    let_go(d);
    return std::int32_t{PHOTOCOAG_GONE};
  };
  if (!read(text, d->settings, message, size)) return refuse();
  d->library = dlopen(d->settings.library.data(), RTLD_NOW | RTLD_LOCAL);
  if (d->library == nullptr) {
    const char* const why = dlerror();
    std::snprintf(message, size, "NI-DAQmx is not there: %s", why == nullptr ? "" : why);
    return refuse();
  }
  if (const char* missing = look_up(d->library, d->call); missing != nullptr) {
    std::snprintf(message, size, "%s has no %s", d->settings.library.data(), missing);
    d->call = {};
    return refuse();
  }
  if (!make_tasks(*d) || !put_power(*d, 0.0) || !put_lines(*d)) {
    std::array<char, 512> why{};
    d->call.error_text(why.data(), why.size() - 1);
    std::snprintf(message, size, "%s: %s", d->settings.device.data(), why.data());
    return refuse();
  }
  *device = d;
  return PHOTOCOAG_GOOD;
}

std::int32_t arm(void* device, std::int64_t period_ns) {
  if (period_ns < 200'000) return PHOTOCOAG_TIMEOUT;  // a software-timed sample takes so long
  Daq& d = *self(device);
  d.period_ns = period_ns;
  d.next_ns = now_ns() + period_ns;
  d.patience = 0.5e-9 * static_cast<double>(period_ns);
  return PHOTOCOAG_GOOD;
}

std::int32_t wait_sample(void* device, std::int64_t deadline_ns, photocoag_sample* sample) {
  Daq& d = *self(device);
  if (d.next_ns > deadline_ns) {
    sleep_until(deadline_ns);
    return PHOTOCOAG_TIMEOUT;
  }
  sleep_until(d.next_ns);
  // What software can do of a watchdog; the circuit behind `alive` does the rest.
  if (d.next_ns - d.last_write_ns > 2 * d.period_ns) put_power(d, 0.0);
  Volts volts;
  if (!get_volts(d, volts)) return PHOTOCOAG_GONE;
  sample->volume_temperature = (volts.temperature - d.settings.zero_V) * d.settings.K_per_V;
  sample->raw = std::llround(volts.temperature * 1e6);  // uV: the library hands out no codes
  sample->sequence = ++d.sequence;
  sample->time_ns = d.next_ns;
  sample->saturated = std::abs(volts.temperature) >= kOfTheRail * d.settings.range_V ? 1 : 0;
  sample->stop_asked = 0;
  d.next_ns += d.period_ns;
  return PHOTOCOAG_GOOD;
}

std::int32_t write_power(void* device, double power, std::uint64_t token) {
  Daq& d = *self(device);
  if (token <= d.token) return PHOTOCOAG_TIMEOUT;
  if (!(power >= 0.0 && power <= 1.0)) return PHOTOCOAG_GONE;
  d.token = token;
  d.last_write_ns = now_ns();
  if (!put_power(d, d.off ? 0.0 : power)) return PHOTOCOAG_GONE;
  d.alive ^= 1U;
  return put_lines(d) ? PHOTOCOAG_GOOD : PHOTOCOAG_GONE;
}

std::int32_t readback(void* device, photocoag_readback* answer) {
  const Daq& d = *self(device);
  Volts volts;
  if (!get_volts(d, volts)) return PHOTOCOAG_GONE;
  std::array<std::uint8_t, 3> lines{};
  std::int32_t count = 0, bytes = 0;
  if (d.call.read_lines(d.switches, 1, d.patience, kDaqByChannel, lines.data(), lines.size(),
                        &count, &bytes, nullptr) < 0 ||
      count != 1) {
    return PHOTOCOAG_GONE;
  }
  answer->power = volts.monitor * d.settings.monitor_W_per_V;
  answer->command = std::numeric_limits<double>::quiet_NaN();  // nobody knows when it was put out
  answer->interlock_closed = lines[0] == 1 ? 1 : 0;
  answer->shutter_open = lines[1] == 1 ? 1 : 0;
  answer->foot_switch = lines[2] == 1 ? 1 : 0;
  return PHOTOCOAG_GOOD;
}

std::int32_t heartbeat(void*, std::uint64_t) { return PHOTOCOAG_GOOD; }

void safe_off(void* device) {
  Daq& d = *self(device);
  d.off = true;
  put_power(d, 0.0);
  put_lines(d);
}

void close(void* device) {
  safe_off(device);
  let_go(self(device));
}

}  // namespace
}  // namespace photocoag

extern "C" const photocoag_driver_table* photocoag_driver(void) {
  using namespace photocoag;
  static const photocoag_driver_table table = {.version = PHOTOCOAG_DRIVER_VERSION,
                                               .size = sizeof(photocoag_driver_table),
                                               .name = "NI-DAQmx device, untried on hardware",
                                               .simulated = 0,
                                               .open = open,
                                               .arm = arm,
                                               .wait_sample = wait_sample,
                                               .write_power = write_power,
                                               .readback = readback,
                                               .heartbeat = heartbeat,
                                               .safe_off = safe_off,
                                               .close = close};
  return &table;
}
