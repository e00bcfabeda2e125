/* Validity of a sample: physical range and outlier gate. Units: K. */
#ifndef PC_SAMPLE_H
#define PC_SAMPLE_H

#include "pc_math.h"

typedef enum {
  PC_UPDATED,   /* the sample was used */
  PC_NO_SAMPLE, /* missing, not finite or physically impossible: prediction only */
  PC_OUTLIER,   /* too far from the prediction: prediction only */
  PC_RESTARTED  /* the estimate was invalid: reset to the initial values */
} pc_sample_use;

/* Samples outside are measurement faults, K. */
#define PC_COLDEST_SAMPLE PC_R(-50.0)
#define PC_HOTTEST_SAMPLE PC_R(300.0)
/* Beyond, the outlier gate is practically open. */
#define PC_MOST_DOUBLINGS 60

/* False for NaN too. */
static inline bool pc_possible_sample(pc_real sample) {
  return sample >= PC_COLDEST_SAMPLE && sample <= PC_HOTTEST_SAMPLE;
}

/* (E25): |innovation| <= gamma 2^r sigma. A lasting change opens the gate. Non-finite innovations
 * pass, so that the filter's own check detects them. */
static inline bool pc_passes_gate(int* doublings, pc_real innovation, pc_real sigma) {
#if PC_OUTLIER_GATE
  pc_real width = PC_OUTLIER_SIGMA * sigma;
  if (!(pc_abs(innovation) > width)) {
    if (*doublings > 0) --*doublings;
    return true;
  }
  for (int r = 0; r < *doublings; ++r) width *= 2;
  if (!(pc_abs(innovation) > width)) return true;
  if (*doublings < PC_MOST_DOUBLINGS) ++*doublings;
  return false;
#else
  (void)doublings;
  (void)innovation;
  (void)sigma;
  return true;
#endif
}

#endif
