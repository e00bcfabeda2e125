/* Bad and hostile inputs, two controllers side by side; for the sanitizers. Exit code 0: powers are
 * always those of the gate, NaN gives 0 W, and neither controller felt the other. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "pc_controller.h"

#ifndef PERIODS
#define PERIODS 4000
#endif

static uint64_t state = 88172645463325252U;

static double uniform(void) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return (double)(state >> 11) / 9007199254740992.0;
}

static double hostile(double usual) {
  const double kind = uniform();
  if (kind < 0.02) return NAN;
  if (kind < 0.03) return INFINITY;
  if (kind < 0.04) return -INFINITY;
  if (kind < 0.06) return 1e38 * (uniform() - 0.5);
  if (kind < 0.08) return 1e-38 * uniform();
  if (kind < 0.20) return 400.0 * (uniform() - 0.5);
  return usual;
}

static int wrong(pc_real power, pc_real sample, pc_real applied) {
  if (!(power >= 0 && power <= PC_POWER_MAX)) return 1;
  return (!isfinite(sample) || !isfinite(applied)) && power > 0;
}

int main(void) {
  static pc_controller alone, left, right;
  static pc_real samples[PERIODS], powers[PERIODS], given[PERIODS];
  int failures = 0;
  pc_controller_init(&alone);
  pc_real power = pc_controller_start(&alone);
  for (int n = 0; n < PERIODS; ++n) {
    samples[n] = (pc_real)hostile(20.0 * uniform());
    powers[n] = (pc_real)hostile((double)power);
    power = uniform() < 0.05 ? pc_controller_step_without_sample(&alone, powers[n])
                             : pc_controller_step(&alone, samples[n], powers[n]);
    failures += wrong(power, 0, powers[n]);
  }
  pc_controller_init(&left);
  pc_controller_init(&right);
  pc_controller_start(&left);
  pc_controller_start(&right);
  for (int n = 0; n < PERIODS; ++n) {
    given[n] = pc_controller_step(&left, samples[n], powers[n]);
    failures += wrong(given[n], samples[n], powers[n]);
    pc_controller_step(&right, samples[PERIODS - 1 - n], powers[n]);
  }
  pc_controller_init(&alone);
  pc_controller_start(&alone);
  for (int n = 0; n < PERIODS; ++n) {
    const pc_real again = pc_controller_step(&alone, samples[n], powers[n]);
    failures += again < given[n] || again > given[n];
  }
  printf("%d failures\n", failures);
  return failures > 0;
}
