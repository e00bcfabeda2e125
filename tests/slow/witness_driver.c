/* A driver that writes down when light really came: at the first power above the self-test's of
 * every opening it adds to the file LIGHT how many intents the session's journal JOURNAL holds.
 * Settings: "journal=JOURNAL light=LIGHT". The tissue is a lump with one time constant. */
#define _POSIX_C_SOURCE 200809L
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "photocoag/device/driver.h"

static const double kSelfTest = 0.002; /* W */

static struct {
  char journal[2048];
  char light[2048];
  double temperature, power, emitted;
  int64_t period_ns, next_ns, last_write_ns;
  uint64_t token, sequence, random;
  int lit;
} d;

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

static int count_intents(void) {
  FILE* file = fopen(d.journal, "r");
  if (file == NULL) return 0;
  int count = 0;
  static char line[65536];
  while (fgets(line, sizeof line, file) != NULL) {
    count += strstr(line, "\"event\":\"intent\"") != NULL;
  }
  fclose(file);
  return count;
}

static void note_light(void) {
  char text[32];
  const int size = snprintf(text, sizeof text, "%d\n", count_intents());
  const int file = open(d.light, O_WRONLY | O_CREAT | O_APPEND, 0600);
  if (file < 0 || write(file, text, (size_t)size) != size) abort();
  close(file);
}

static int32_t open_device(void** device, const char* settings, char* message, uint32_t size) {
  memset(&d, 0, sizeof d);
  if (sscanf(settings, "journal=%2047s light=%2047s", d.journal, d.light) != 2) {
    snprintf(message, size, "journal=FILE light=FILE");
    return PHOTOCOAG_GONE;
  }
  d.random = 1;
  *device = &d;
  return PHOTOCOAG_GOOD;
}

static int32_t arm(void* device, int64_t period_ns) {
  (void)device;
  d.period_ns = period_ns;
  d.next_ns = now_ns() + period_ns;
  return PHOTOCOAG_GOOD;
}

static double noise(void) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) {
    d.random ^= d.random >> 12;
    d.random ^= d.random << 25;
    d.random ^= d.random >> 27;
    sum += (double)((d.random * 2685821657736338717U) >> 11) / 9007199254740992.0;
  }
  return 0.288 * sum;
}

static int32_t wait_sample(void* device, int64_t deadline_ns, photocoag_sample* sample) {
  (void)device;
  if (d.next_ns > deadline_ns) {
    sleep_until(deadline_ns);
    return PHOTOCOAG_TIMEOUT;
  }
  sleep_until(d.next_ns);
  if (d.next_ns - d.last_write_ns > 2 * d.period_ns) d.power = 0.0;
  d.emitted = d.power;
  const double keep = exp(-(double)d.period_ns * 1e-9 / 0.02);
  d.temperature = keep * d.temperature + (1.0 - keep) * 600.0 * d.emitted;
  sample->volume_temperature = d.temperature + noise();
  sample->raw = (int64_t)(sample->volume_temperature * 1e9);
  sample->sequence = ++d.sequence;
  sample->time_ns = d.next_ns;
  sample->saturated = sample->stop_asked = 0;
  d.next_ns += d.period_ns;
  return PHOTOCOAG_GOOD;
}

static int32_t write_power(void* device, double power, uint64_t token) {
  (void)device;
  if (token <= d.token) return PHOTOCOAG_TIMEOUT;
  if (!d.lit && power > kSelfTest) {
    d.lit = 1;
    note_light();
  }
  d.token = token;
  d.last_write_ns = now_ns();
  d.power = power;
  return PHOTOCOAG_GOOD;
}

static int32_t readback(void* device, photocoag_readback* answer) {
  (void)device;
  *answer = (photocoag_readback){d.emitted, d.emitted, 1, 1, 1};
  return PHOTOCOAG_GOOD;
}

static int32_t heartbeat(void* device, uint64_t cycle) {
  (void)device;
  (void)cycle;
  return PHOTOCOAG_GOOD;
}

static void safe_off(void* device) {
  (void)device;
  d.power = 0.0;
}

const photocoag_driver_table* photocoag_driver(void) {
  static const photocoag_driver_table table = {.version = PHOTOCOAG_DRIVER_VERSION,
                                               .size = sizeof(photocoag_driver_table),
                                               .name = "witness",
                                               .simulated = 1,
                                               .open = open_device,
                                               .arm = arm,
                                               .wait_sample = wait_sample,
                                               .write_power = write_power,
                                               .readback = readback,
                                               .heartbeat = heartbeat,
                                               .safe_off = safe_off,
                                               .close = safe_off};
  return &table;
}
