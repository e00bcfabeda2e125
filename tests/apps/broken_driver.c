/* A driver that keeps every promise of device/driver.h but the one that its settings name:
 * "break=NAME". The tissue stays cold. BREAK_TABLE: its table claims another version. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "photocoag/device/driver.h"

typedef struct {
  char fault[32];
  double power, emitted, in_force;
  int64_t period_ns, next_ns, last_write_ns;
  uint64_t token, sequence;
  int interlock_closed, opened;
} state;

static state s;

static int breaks(const char* fault) { return strcmp(s.fault, fault) == 0; }

static int64_t now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void sleep_until(int64_t when) {
  struct timespec t = {.tv_sec = (time_t)(when / 1000000000), .tv_nsec = (long)(when % 1000000000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) != 0) {
  }
}

static int32_t open_device(void** device, const char* settings, char* message, uint32_t size) {
  const int opened = s.opened;
  memset(&s, 0, sizeof s);
  s.opened = opened + 1;
  const char* found = strstr(settings, "break=");
  if (found != NULL) sscanf(found + 6, "%31s", s.fault);
  if (strstr(settings, "fail") != NULL) {
    if (breaks("message-beyond")) memset(message, 'x', size + 4);
    if (breaks("message-empty") && size > 0) message[0] = '\0';
    if (s.fault[0] == '\0') snprintf(message, size, "asked to fail by its settings");
    return PHOTOCOAG_GONE;
  }
  if (breaks("reopen") && s.opened > 1) return PHOTOCOAG_GONE;
  if (breaks("open")) s.power = 0.001;
  s.interlock_closed = 1;
  *device = &s;
  return breaks("answer") ? 7 : PHOTOCOAG_GOOD;
}

static int32_t arm(void* device, int64_t period_ns) {
  (void)device;
  s.period_ns = period_ns;
  s.next_ns = now_ns() + period_ns;
  s.last_write_ns = breaks("open") ? now_ns() : 0;
  return PHOTOCOAG_GOOD;
}

static int32_t wait_sample(void* device, int64_t deadline_ns, photocoag_sample* sample) {
  (void)device;
  if (breaks("hang")) sleep_until(INT64_MAX / 2);
  if (breaks("crash")) abort();
  if (s.next_ns > deadline_ns && !breaks("deadline")) {
    sleep_until(deadline_ns);
    if (breaks("deadline-loses")) {
      ++s.sequence;
      s.next_ns += s.period_ns;
    }
    return PHOTOCOAG_TIMEOUT;
  }
  if (!breaks("early")) sleep_until(s.next_ns);
  if (breaks("late")) {
    /* Only the newest is kept. */
    while (s.next_ns + s.period_ns < now_ns()) {
      ++s.sequence;
      s.next_ns += s.period_ns;
    }
  }
  if (!breaks("watchdog") && s.next_ns - s.last_write_ns > 2 * s.period_ns) s.power = 0.0;
  s.in_force = s.power;
  s.emitted = s.interlock_closed ? s.power : 0.0;
  sample->volume_temperature = 0.0;
  sample->raw = (int64_t)s.sequence;
  sample->sequence = breaks("order") && s.sequence == 7 ? s.sequence : ++s.sequence;
  sample->time_ns = breaks("time") ? now_ns() / 1000 : s.next_ns;
  sample->saturated = 0;
  sample->stop_asked = 0;
  s.next_ns += s.period_ns;
  return PHOTOCOAG_GOOD;
}

static int32_t write_power(void* device, double power, uint64_t token) {
  (void)device;
  if (breaks("slow")) sleep_until(now_ns() + s.period_ns * 3 / 4);
  if (breaks("allocation")) {
    void* volatile memory = malloc(16);
    free(memory);
  }
  if (breaks("feeding") && token == s.token) s.last_write_ns = now_ns();
  if (token <= s.token && !breaks("tokens")) return PHOTOCOAG_TIMEOUT;
  if (!(power >= 0.0 && power <= 1.0) && !breaks("powers")) return PHOTOCOAG_GONE;
  s.token = token;
  s.last_write_ns = now_ns();
  s.power = power;
  return PHOTOCOAG_GOOD;
}

static int32_t readback(void* device, photocoag_readback* answer) {
  (void)device;
  answer->power = breaks("readback") ? 2.0 * s.emitted : s.emitted;
  answer->command = s.in_force;
  answer->interlock_closed = s.interlock_closed;
  answer->shutter_open = breaks("switches") ? 5 : 1;
  answer->foot_switch = 1;
  return PHOTOCOAG_GOOD;
}

static int32_t heartbeat(void* device, uint64_t cycle) {
  (void)device;
  (void)cycle;
  if (breaks("heartbeat")) s.last_write_ns = now_ns();
  return PHOTOCOAG_GOOD;
}

static void safe_off(void* device) {
  (void)device;
  s.power = 0.0;
  s.interlock_closed = breaks("safe-off");
}

static void close_device(void* device) { (void)device; }

const photocoag_driver_table* photocoag_driver(void) {
  static const photocoag_driver_table table = {
#ifdef BREAK_TABLE
      .version = PHOTOCOAG_DRIVER_VERSION + 1,
#else
      .version = PHOTOCOAG_DRIVER_VERSION,
#endif
      .size = sizeof(photocoag_driver_table),
      .name = "broken in one place",
      .simulated = 1,
      .open = open_device,
      .arm = arm,
      .wait_sample = wait_sample,
      .write_power = write_power,
      .readback = readback,
      .heartbeat = heartbeat,
      .safe_off = safe_off,
      .close = close_device};
  return &table;
}
