/* A complete driver for photocoag (docs/devices.md) without hardware: tissue that warms and cools
 * with one time constant. Replace the parts marked HARDWARE.
 * Settings: "gain=K_per_W tau=seconds noise=K fail=open|none", all optional.
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "photocoag/device/driver.h"

#ifndef EXAMPLE_SIMULATED
#define EXAMPLE_SIMULATED 1 /* HARDWARE: 0; then safety.real_time = "enforce" is required */
#endif

typedef struct {
  double gain;        /* K/W */
  double tau;         /* s */
  double noise;       /* K, standard deviation of a sample */
  double temperature; /* K */
  double power;       /* W, emitted now */
  double emitted;     /* W, during the last period */
  double in_force;    /* W, the command of the last period */
  int64_t period_ns;
  int64_t next_ns;       /* end of the current period */
  int64_t last_write_ns; /* for the watchdog */
  uint64_t token;        /* of the last accepted write */
  uint64_t sequence;
  uint64_t random; /* state of the noise */
  int interlock_closed;
} example;

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

/* Approximately normal, standard deviation 1: the sum of twelve uniform numbers (xorshift64*). */
static double next_normal(example* e) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) {
    e->random ^= e->random >> 12;
    e->random ^= e->random << 25;
    e->random ^= e->random >> 27;
    sum += (double)((e->random * 2685821657736338717U) >> 11) / 9007199254740992.0;
  }
  return sum;
}

static double setting(const char* settings, const char* name, double otherwise) {
  const char* found = strstr(settings, name);
  return found != NULL ? strtod(found + strlen(name), NULL) : otherwise;
}

static int32_t example_open(void** device, const char* settings, char* message,
                            uint32_t message_size) {
  if (strstr(settings, "fail=open") != NULL) {
    snprintf(message, message_size, "asked to fail by its settings");
    return PHOTOCOAG_GONE;
  }
  example* e = calloc(1, sizeof *e);
  if (e == NULL) return PHOTOCOAG_GONE;
  e->gain = setting(settings, "gain=", 600.0);
  e->tau = setting(settings, "tau=", 0.02);
  e->noise = setting(settings, "noise=", 0.288); /* as plant.noise_K, for the self-test */
  e->random = 1;
  e->interlock_closed = 1; /* HARDWARE: open the card, put 0 W, read the switches */
  *device = e;
  return PHOTOCOAG_GOOD;
}

static int32_t example_arm(void* device, int64_t period_ns) {
  example* e = device;
  if (period_ns < 50000) return PHOTOCOAG_TIMEOUT;
  e->period_ns = period_ns;
  e->next_ns = now_ns() + period_ns;
  return PHOTOCOAG_GOOD;
}

static int32_t example_wait_sample(void* device, int64_t deadline_ns, photocoag_sample* sample) {
  example* e = device;
  if (e->next_ns > deadline_ns) {
    sleep_until(deadline_ns);
    return PHOTOCOAG_TIMEOUT;
  }
  sleep_until(e->next_ns); /* HARDWARE: wait for the trigger of the period's last pulse */
  /* The watchdog: 0 W without a new token for two periods. */
  if (e->next_ns - e->last_write_ns > 2 * e->period_ns) e->power = 0.0;
  e->in_force = e->power;
  e->emitted = e->interlock_closed ? e->power : 0.0;
  const double keep = exp(-(double)e->period_ns * 1e-9 / e->tau);
  e->temperature = keep * e->temperature + (1.0 - keep) * e->gain * e->emitted;
  sample->volume_temperature = e->temperature + e->noise * next_normal(e);
  sample->raw = (int64_t)(sample->volume_temperature * 1e9);
  sample->sequence = ++e->sequence;
  sample->time_ns = e->next_ns;
  sample->saturated = 0;
  sample->stop_asked = 0;
  e->next_ns += e->period_ns;
  return PHOTOCOAG_GOOD;
}

static int32_t example_write_power(void* device, double power, uint64_t token) {
  example* e = device;
  if (token <= e->token) return PHOTOCOAG_TIMEOUT; /* an old command is no command */
  if (!(power >= 0.0 && power <= 1.0)) return PHOTOCOAG_GONE;
  e->token = token;
  e->last_write_ns = now_ns();
  e->power = power; /* HARDWARE: write the analogue output */
  return PHOTOCOAG_GOOD;
}

static int32_t example_readback(void* device, photocoag_readback* readback) {
  example* e = device;
  readback->power = e->emitted; /* HARDWARE: the monitor diode */
  readback->command = e->in_force;
  readback->interlock_closed = e->interlock_closed;
  readback->shutter_open = 1;
  readback->foot_switch = 1;
  return PHOTOCOAG_GOOD;
}

static int32_t example_heartbeat(void* device, uint64_t cycle) {
  (void)device;
  (void)cycle;
  return PHOTOCOAG_GOOD;
}

static void example_safe_off(void* device) {
  example* e = device;
  e->power = 0.0;
  e->interlock_closed = 0; /* HARDWARE: open the relay */
}

static void example_close(void* device) { free(device); }

const photocoag_driver_table* photocoag_driver(void) {
  static const photocoag_driver_table table = {.version = PHOTOCOAG_DRIVER_VERSION,
                                               .size = sizeof(photocoag_driver_table),
                                               .name = "example: one time constant",
                                               .simulated = EXAMPLE_SIMULATED,
                                               .open = example_open,
                                               .arm = example_arm,
                                               .wait_sample = example_wait_sample,
                                               .write_power = example_write_power,
                                               .readback = example_readback,
                                               .heartbeat = example_heartbeat,
                                               .safe_off = example_safe_off,
                                               .close = example_close};
  return &table;
}
