/* Role: the C interface of a vendor's driver, loaded from a shared library. See docs/devices.md and
 * examples/driver. Units: SI. Research software, not a medical device.
 *
 * A driver exports one function, photocoag_driver(), which returns a table that lives as long as
 * the library is loaded. All calls come from one thread. Every call must return within the time it
 * is given, or within half a control period; none may throw or terminate. The driver keeps the
 * watchdog, better still the hardware does: without a new token for two periods, 0 W.
 */
#ifndef PHOTOCOAG_DEVICE_DRIVER_H
#define PHOTOCOAG_DEVICE_DRIVER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PHOTOCOAG_DRIVER_VERSION 2U

enum { /* what every call returns */
       PHOTOCOAG_GOOD = 0,
       PHOTOCOAG_TIMEOUT = 1, /* no answer in time; may be better next time */
       PHOTOCOAG_GONE = 2     /* the device has vanished */
};

typedef struct {
  double volume_temperature; /* K over ambient; NaN: none */
  int64_t raw;               /* the converter's code */
  uint64_t sequence;         /* 1, 2, ... one per control period */
  int64_t time_ns;           /* when it was taken, CLOCK_MONOTONIC */
  int32_t saturated;         /* the converter was at its rail */
  int32_t stop_asked;        /* stop button */
} photocoag_sample;

typedef struct {
  double power;             /* W, mean emitted during the last period */
  double command;           /* W, mean of what was in force as the command; NaN: cannot tell */
  int32_t interlock_closed; /* 0 or 1 */
  int32_t shutter_open;
  int32_t foot_switch;
} photocoag_readback;

typedef struct {
  uint32_t version;  /* PHOTOCOAG_DRIVER_VERSION */
  uint32_t size;     /* sizeof(photocoag_driver_table) */
  const char* name;  /* for messages */
  int32_t simulated; /* 1: no light can come out of it */
  /* Opens the device. `settings`: text of the user's, may be empty. On failure writes a message of
   * at most message_size bytes with its zero. The device is at 0 W afterwards. */
  int32_t (*open)(void** device, const char* settings, char* message, uint32_t message_size);
  int32_t (*arm)(void* device, int64_t period_ns);
  /* Blocks until the sample of the running period is there, at most until deadline_ns. */
  int32_t (*wait_sample)(void* device, int64_t deadline_ns, photocoag_sample* sample);
  int32_t (*write_power)(void* device, double power, uint64_t token);
  int32_t (*readback)(void* device, photocoag_readback* readback);
  int32_t (*heartbeat)(void* device, uint64_t cycle);
  void (*safe_off)(void* device); /* 0 W and interlock open, by whatever way is left */
  void (*close)(void* device);    /* 0 W first */
} photocoag_driver_table;

const photocoag_driver_table* photocoag_driver(void);

#ifdef __cplusplus
}
#endif
#endif
