/* The exported controller on an eye that differs, with noise, missing samples and powers that are
 * not quite those commanded: every power in full precision, for two machines to be compared
 * (tools/aarch64). */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "pc_controller.h"

static pc_controller controller;

/* The same numbers everywhere: -1 to 1. */
static double noise(void) {
  static uint32_t state = 1;
  state = state * 1664525u + 1013904223u;
  return (double)(state >> 8) / 8388608.0 - 1.0;
}

int main(int argc, char** argv) {
  const long periods = argc > 1 ? strtol(argv[1], NULL, 10) : 5000;
  pc_controller_init(&controller);
  pc_real power = pc_controller_start(&controller);
  /* Two lags, far from any model: what the controller does about them is not the point. */
  double fast = 0, slow = 0;
  for (long n = 0; n < periods; ++n) {
    if (n % 500 == 0) { /* another spot */
      pc_controller_init(&controller);
      power = pc_controller_start(&controller);
      fast = slow = 0;
    }
    const double applied = (double)power * (1.0 + 0.01 * noise());
    fast += 0.5 * (190.0 * applied - fast);
    slow += 0.01 * (400.0 * applied - slow);
    const double sample = fast + slow + 0.3 * noise();
    power = n % 37 == 36 ? pc_controller_step_without_sample(&controller, (pc_real)applied)
                         : pc_controller_step(&controller, (pc_real)sample, (pc_real)applied);
    printf("%.17g %.17g\n", (double)power, (double)pc_controller_peak(&controller));
  }
  return 0;
}
