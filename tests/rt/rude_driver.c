/* A driver whose every call leaves the floating-point environment changed: another rounding, traps,
 * denormals flushed. Settings: "die=FILE": the third sample divides by zero with traps enabled;
 * safe_off writes FILE; "slow": the first wait brings none. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <fenv.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "photocoag/device/driver.h"

static char mark[4096];
static uint64_t samples;
static bool slow;

static void disturb(void) {
  fesetround(FE_UPWARD);
#ifdef __SSE__
  _mm_setcsr(_mm_getcsr() | 0x8040U); /* flush to zero, denormals are zero */
#endif
  feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
}

static int32_t rude_open(void** device, const char* settings, char* message, uint32_t size) {
  (void)message;
  (void)size;
  const char* found = strstr(settings, "die=");
  snprintf(mark, sizeof mark, "%s", found != NULL ? found + 4 : "");
  slow = strstr(settings, "slow") != NULL;
  samples = 0;
  *device = mark;
  disturb();
  return PHOTOCOAG_GOOD;
}

static int32_t rude_arm(void* device, int64_t period_ns) {
  (void)device;
  (void)period_ns;
  disturb();
  return PHOTOCOAG_GOOD;
}

static int32_t rude_wait_sample(void* device, int64_t deadline_ns, photocoag_sample* sample) {
  (void)device;
  (void)deadline_ns;
  disturb();
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  sample->sequence = ++samples;
  if (slow) {
    slow = false;
    --samples;
    return PHOTOCOAG_TIMEOUT;
  }
  volatile double zero = 0.0;
  volatile double infinite = 0.0;
  if (mark[0] != '\0' && samples == 3) infinite = 1.0 / zero;
  sample->volume_temperature = 0.25 + infinite;
  sample->raw = (int64_t)samples;
  sample->time_ns = (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
  return PHOTOCOAG_GOOD;
}

static int32_t rude_write_power(void* device, double power, uint64_t token) {
  (void)device;
  (void)power;
  (void)token;
  disturb();
  return PHOTOCOAG_GOOD;
}

static int32_t rude_readback(void* device, photocoag_readback* readback) {
  (void)device;
  disturb();
  *readback = (photocoag_readback){0.0, 0.0, 1, 1, 1};
  return PHOTOCOAG_GOOD;
}

static int32_t rude_heartbeat(void* device, uint64_t cycle) {
  (void)device;
  (void)cycle;
  disturb();
  return PHOTOCOAG_GOOD;
}

static void rude_safe_off(void* device) {
  (void)device;
  disturb();
  if (mark[0] == '\0') return;
  const int file = open(mark, O_WRONLY | O_CREAT, 0600);
  if (file >= 0) close(file);
}

static void rude_close(void* device) {
  (void)device;
  disturb();
}

const photocoag_driver_table* photocoag_driver(void) {
  static const photocoag_driver_table table = {.version = PHOTOCOAG_DRIVER_VERSION,
                                               .size = sizeof(photocoag_driver_table),
                                               .name = "rude",
                                               .simulated = 1,
                                               .open = rude_open,
                                               .arm = rude_arm,
                                               .wait_sample = rude_wait_sample,
                                               .write_power = rude_write_power,
                                               .readback = rude_readback,
                                               .heartbeat = rude_heartbeat,
                                               .safe_off = rude_safe_off,
                                               .close = rude_close};
  disturb();
  return &table;
}
