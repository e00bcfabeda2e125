/* A simulated treatment: the controller and, as the eye, the reduced model at another absorption
 * factor. Prints time, power, and the true and the estimated peak. On a microcontroller the body of
 * the loop is the interrupt handler of a timer, see README.md. Research software, not a medical
 * device. */
#include <math.h>
#include <stdio.h>

#include "pc_controller.h"

#define PERIODS 250
#define EYE_ALPHA ((pc_real)1.1)

static pc_controller controller;
static pc_real eye[PC_ORDER];

/* sum_i a_i b_i. */
static pc_real dot(const pc_real* a, const pc_real* b) {
  pc_real sum = 0;
  for (int i = 0; i < PC_ORDER; ++i) sum += a[i] * b[i];
  return sum;
}

/* One period of the eye; its volume temperature and peak, K. */
static pc_real heat(pc_real power, pc_real* peak) {
#if PC_POSTERIOR
  static pc_residues of_peak, of_sample;
  pc_real at[PC_QUANTITIES] = {0}; /* the prior mean */
  at[0] = (pc_real)log((double)EYE_ALPHA) - pc_prior_mean[0];
  pc_evaluate(at, &of_peak, &of_sample);
  pc_propagate(eye);
  for (int i = 0; i < PC_ORDER; ++i) eye[i] += pc_gain[i] * power;
  *peak = dot(of_peak.value, eye);
  return dot(of_sample.value, eye);
#else
  pc_matrices matrices;
  pc_evaluate(EYE_ALPHA, &matrices);
  pc_propagate(eye);
  for (int i = 0; i < PC_ORDER; ++i) eye[i] += matrices.input[i] * power;
  *peak = dot(pc_peak_row, eye);
  return dot(matrices.volume, eye);
#endif
}

int main(void) {
  pc_controller_init(&controller);
  pc_real power = pc_controller_start(&controller);
  printf("time_ms power_mW peak_K estimated_peak_K\n");
  for (int n = 1; n <= PERIODS; ++n) {
    pc_real peak = 0;
    const pc_real applied = power;
    const pc_real sample = heat(applied, &peak);
    power = pc_controller_step(&controller, sample, applied);
    if (n <= 10 || n % 50 == 0) {
      printf("%g %.4f %.4f %.4f\n", n * 1e3 * (double)PC_PERIOD, 1e3 * (double)applied,
             (double)peak, (double)pc_controller_peak(&controller));
    }
  }
  return 0;
}
