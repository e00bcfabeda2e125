// Role: online; a laser and its temperature signal behind a data acquisition card that Comedi
// knows, as a driver of photocoag (device/driver.h). Compiled against libcomedi 0.11 and tested
// with a stand-in for it (tests/comedi): UNTRIED ON HARDWARE. Research software, not a medical
// device. Source: docs/devices.md, the interface comedilib.h. Units: V at the card, SI outside.
// Real time: after arm no allocation; every call is one synchronous instruction of the kernel's
// driver, which Comedi does not bound in time. Comedi has no watchdog: bit `alive` changes with
// every new token, and a circuit outside must open the laser's interlock if it stops changing.
#include <comedilib.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <initializer_list>
#include <limits>
#include <new>

#include "photocoag/device/driver.h"

namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

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

/// One analogue channel with its range.
struct Channel {
  unsigned subdevice = 0;
  unsigned channel = 0;
  unsigned range = 0;
  lsampl_t largest = 0;
  comedi_range* volts = nullptr;
};

struct Settings {
  char file[256] = "/dev/comedi0";
  double ai = 0, ao = 1, dio = 2;               // subdevices
  double temperature = 0, monitor = 1;          // channels of ai
  double power = 0;                             // channel of ao
  double interlock = 0, shutter = 1, foot = 2;  // bits of dio, 1: closed, open, pressed
  double relay = 3, alive = 4;                  // bits of dio, outputs
  double K_per_V = 0, W_per_V = 0, monitor_W_per_V = 0;
  double zero_V = 0;  // of the temperature signal
};

struct Comedi {
  Settings settings;
  comedi_t* card = nullptr;
  Channel temperature, monitor, power;
  std::int64_t period_ns = 0;
  std::int64_t next_ns = 0;
  std::int64_t last_write_ns = 0;
  std::uint64_t token = 0;
  std::uint64_t sequence = 0;
  unsigned alive = 0;
  bool off = false;
};

Comedi* self(void* device) { return static_cast<Comedi*>(device); }

struct Number {
  const char* name;
  double Settings::*value;
};
constexpr Number kNumbers[] = {{"ai", &Settings::ai},
                               {"ao", &Settings::ao},
                               {"dio", &Settings::dio},
                               {"temperature", &Settings::temperature},
                               {"monitor", &Settings::monitor},
                               {"power", &Settings::power},
                               {"interlock", &Settings::interlock},
                               {"shutter", &Settings::shutter},
                               {"foot", &Settings::foot},
                               {"relay", &Settings::relay},
                               {"alive", &Settings::alive},
                               {"K_per_V", &Settings::K_per_V},
                               {"W_per_V", &Settings::W_per_V},
                               {"monitor_W_per_V", &Settings::monitor_W_per_V},
                               {"zero_V", &Settings::zero_V}};

/// "name=value name=value …"; the first word that is not understood goes into `message`.
bool read(const char* text, Settings& settings, char* message, std::uint32_t size) {
  char words[1024];
  std::snprintf(words, sizeof(words), "%s", text);
  char* rest = nullptr;
  for (char* word = strtok_r(words, " \n\t", &rest); word != nullptr;
       word = strtok_r(nullptr, " \n\t", &rest)) {
    char* value = std::strchr(word, '=');
    if (value != nullptr) *value++ = '\0';
    bool known = false;
    if (value != nullptr && std::strcmp(word, "file") == 0) {
      known = true;
      std::snprintf(settings.file, sizeof(settings.file), "%s", value);
    }
    for (const Number& number : kNumbers) {
      if (value == nullptr || std::strcmp(word, number.name) != 0) continue;
      char* end = nullptr;
      settings.*number.value = std::strtod(value, &end);
      known = end != value && *end == '\0' && std::isfinite(settings.*number.value);
    }
    if (!known) {
      std::snprintf(message, size, "setting %s: not understood", word);
      return false;
    }
  }
  const bool scaled =
      settings.K_per_V != 0.0 && settings.W_per_V > 0.0 && settings.monitor_W_per_V > 0.0;
  if (!scaled) {
    std::snprintf(message, size,
                  "K_per_V, W_per_V and monitor_W_per_V must be given: there is no default scale");
  }
  return scaled;
}

bool find(comedi_t* card, double subdevice, double channel, Channel& found) {
  found.subdevice = static_cast<unsigned>(subdevice);
  found.channel = static_cast<unsigned>(channel);
  found.largest = comedi_get_maxdata(card, found.subdevice, found.channel);
  found.volts = comedi_get_range(card, found.subdevice, found.channel, found.range);
  return found.largest > 0 && found.volts != nullptr;
}

bool write_bit(const Comedi& c, double bit, unsigned value) {
  return comedi_dio_write(c.card, static_cast<unsigned>(c.settings.dio), static_cast<unsigned>(bit),
                          value) == 1;
}

bool read_bit(const Comedi& c, double bit) {
  unsigned value = 0;
  return comedi_dio_read(c.card, static_cast<unsigned>(c.settings.dio), static_cast<unsigned>(bit),
                         &value) == 1 &&
         value == 1;
}

bool put_power(const Comedi& c, double power) {
  const lsampl_t code =
      comedi_from_phys(power / c.settings.W_per_V, c.power.volts, c.power.largest);
  return comedi_data_write(c.card, c.power.subdevice, c.power.channel, c.power.range, AREF_GROUND,
                           code) == 1;
}

bool get_code(const Comedi& c, const Channel& from, lsampl_t& code) {
  return comedi_data_read(c.card, from.subdevice, from.channel, from.range, AREF_GROUND, &code) ==
         1;
}

std::int32_t open(void** device, const char* text, char* message, std::uint32_t size) {
  auto* c = new (std::nothrow) Comedi;
  if (c == nullptr) return PHOTOCOAG_GONE;
  const auto refuse = [&](const char* why) {
    if (why != nullptr) std::snprintf(message, size, "%s: %s", c->settings.file, why);
    if (c->card != nullptr) comedi_close(c->card);
    delete c;
    return std::int32_t{PHOTOCOAG_GONE};
  };
  if (!read(text, c->settings, message, size)) return refuse(nullptr);
  const Settings& s = c->settings;
  c->card = comedi_open(s.file);
  if (c->card == nullptr) return refuse(comedi_strerror(comedi_errno()));
  if (!find(c->card, s.ai, s.temperature, c->temperature)) return refuse("no temperature channel");
  if (!find(c->card, s.ai, s.monitor, c->monitor)) return refuse("no monitor channel");
  if (!find(c->card, s.ao, s.power, c->power)) return refuse("no power channel");
  const auto dio = static_cast<unsigned>(s.dio);
  for (const double bit : {s.interlock, s.shutter, s.foot}) {
    if (comedi_dio_config(c->card, dio, static_cast<unsigned>(bit), COMEDI_INPUT) != 0) {
      return refuse("a switch cannot be read");
    }
  }
  for (const double bit : {s.relay, s.alive}) {
    if (comedi_dio_config(c->card, dio, static_cast<unsigned>(bit), COMEDI_OUTPUT) != 0) {
      return refuse("relay or alive cannot be written");
    }
  }
  comedi_set_global_oor_behavior(COMEDI_OOR_NUMBER);
  if (!put_power(*c, 0.0) || !write_bit(*c, s.alive, 0) || !write_bit(*c, s.relay, 1)) {
    return refuse("0 W cannot be written");
  }
  *device = c;
  return PHOTOCOAG_GOOD;
}

std::int32_t arm(void* device, std::int64_t period_ns) {
  if (period_ns < 50'000) return PHOTOCOAG_TIMEOUT;
  self(device)->period_ns = period_ns;
  self(device)->next_ns = now_ns() + period_ns;
  return PHOTOCOAG_GOOD;
}

std::int32_t wait_sample(void* device, std::int64_t deadline_ns, photocoag_sample* sample) {
  Comedi& c = *self(device);
  if (c.next_ns > deadline_ns) {
    sleep_until(deadline_ns);
    return PHOTOCOAG_TIMEOUT;
  }
  sleep_until(c.next_ns);
  // What software can do of a watchdog; the circuit behind `alive` does the rest.
  if (c.next_ns - c.last_write_ns > 2 * c.period_ns) put_power(c, 0.0);
  lsampl_t code = 0;
  if (!get_code(c, c.temperature, code)) return PHOTOCOAG_GONE;
  const double volts = comedi_to_phys(code, c.temperature.volts, c.temperature.largest);
  sample->volume_temperature = (volts - c.settings.zero_V) * c.settings.K_per_V;
  sample->raw = static_cast<std::int64_t>(code);
  sample->sequence = ++c.sequence;
  sample->time_ns = c.next_ns;
  sample->saturated = code == 0 || code == c.temperature.largest ? 1 : 0;
  sample->stop_asked = 0;
  c.next_ns += c.period_ns;
  return PHOTOCOAG_GOOD;
}

std::int32_t write_power(void* device, double power, std::uint64_t token) {
  Comedi& c = *self(device);
  if (token <= c.token) return PHOTOCOAG_TIMEOUT;
  if (!(power >= 0.0 && power <= 1.0)) return PHOTOCOAG_GONE;
  c.token = token;
  c.last_write_ns = now_ns();
  if (!put_power(c, c.off ? 0.0 : power)) return PHOTOCOAG_GONE;
  c.alive ^= 1U;
  return write_bit(c, c.settings.alive, c.alive) ? PHOTOCOAG_GOOD : PHOTOCOAG_GONE;
}

std::int32_t readback(void* device, photocoag_readback* answer) {
  const Comedi& c = *self(device);
  lsampl_t code = 0;
  if (!get_code(c, c.monitor, code)) return PHOTOCOAG_GONE;
  answer->power =
      comedi_to_phys(code, c.monitor.volts, c.monitor.largest) * c.settings.monitor_W_per_V;
  answer->command =
      std::numeric_limits<double>::quiet_NaN();  // nobody knows when a card put it out
  answer->interlock_closed = read_bit(c, c.settings.interlock) ? 1 : 0;
  answer->shutter_open = read_bit(c, c.settings.shutter) ? 1 : 0;
  answer->foot_switch = read_bit(c, c.settings.foot) ? 1 : 0;
  return PHOTOCOAG_GOOD;
}

std::int32_t heartbeat(void*, std::uint64_t) { return PHOTOCOAG_GOOD; }

void safe_off(void* device) {
  Comedi& c = *self(device);
  c.off = true;
  put_power(c, 0.0);
  write_bit(c, c.settings.relay, 0);
}

void close(void* device) {
  Comedi* c = self(device);
  safe_off(c);
  comedi_close(c->card);
  delete c;
}

}  // namespace

extern "C" const photocoag_driver_table* photocoag_driver(void) {
  static const photocoag_driver_table table = {.version = PHOTOCOAG_DRIVER_VERSION,
                                               .size = sizeof(photocoag_driver_table),
                                               .name = "Comedi card, untried on hardware",
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
