/* Role: the C interface of a vendor's driver, loaded from a shared library. See docs/devices.md and
 * examples/driver. Units: SI. Research software, not a medical device.
 *
 * A driver exports one function, photocoag_driver(), which returns a table that is valid as long as
 * the library is loaded. All calls come from one thread. Every call must return by its deadline, or
 * within half a control period; none may throw or terminate. The driver, or better the hardware,
 * implements the watchdog: 0 W without a new token for two periods.
 */
#ifndef PHOTOCOAG_DEVICE_DRIVER_H
#define PHOTOCOAG_DEVICE_DRIVER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PHOTOCOAG_DRIVER_VERSION 2U

enum { /* results of all calls */
       PHOTOCOAG_GOOD = 0,
       PHOTOCOAG_TIMEOUT =
           1,             /* no answer in time, or the call was refused; may succeed next time */
       PHOTOCOAG_GONE = 2 /* the device has vanished */
};

typedef struct {
  double volume_temperature; /* K over ambient; NaN: none */
  int64_t raw;               /* the converter's code */
  uint64_t sequence;         /* 1, 2, ... one per control period */
  int64_t time_ns;           /* when the sample was taken, CLOCK_MONOTONIC */
  int32_t saturated;         /* the converter was at its rail */
  int32_t stop_asked;        /* stop button */
} photocoag_sample;

typedef struct {
  double power;             /* W, mean emitted during the last period */
  double command;           /* W, mean of the command in force during it; NaN: not reported */
  int32_t interlock_closed; /* 0 or 1 */
  int32_t shutter_open;
  int32_t foot_switch;
} photocoag_readback;

typedef struct {
  uint32_t version;  /* PHOTOCOAG_DRIVER_VERSION */
  uint32_t size;     /* sizeof(photocoag_driver_table) */
  const char* name;  /* for messages */
  int32_t simulated; /* 1: it cannot emit light */
  /* Opens the device at 0 W. `settings`: the user's text, may be empty. On failure writes a message
   * of at most message_size bytes, terminating zero included. */
  int32_t (*open)(void** device, const char* settings, char* message, uint32_t message_size);
  /* Starts control periods of period_ns; no allocation afterwards. */
  int32_t (*arm)(void* device, int64_t period_ns);
  /* Blocks until the sample of the current period is available, at most until deadline_ns
   * (CLOCK_MONOTONIC). */
  int32_t (*wait_sample)(void* device, int64_t deadline_ns, photocoag_sample* sample);
  /* W, for the next period. Refused unless the token is larger than the last one. */
  int32_t (*write_power)(void* device, double power, uint64_t token);
  int32_t (*readback)(void* device, photocoag_readback* readback);
  /* The controller has finished this cycle; does not feed the watchdog. */
  int32_t (*heartbeat)(void* device, uint64_t cycle);
  void (*safe_off)(void* device); /* 0 W and interlock open, by any means still available */
  void (*close)(void* device);    /* 0 W first */
} photocoag_driver_table;

const photocoag_driver_table* photocoag_driver(void);

#ifdef __cplusplus
}
#endif
#endif
