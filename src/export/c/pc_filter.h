/* The reduced model at the estimated absorption factor, and the extended Kalman filter of state and
 * absorption factor, (E9), (E10), (E14) to (E17), (E25) of docs/equations.md of photocoag.
 * Units: SI; temperatures are rises over ambient, K. Bounded loops, no heap, no globals. */
#ifndef PC_FILTER_H
#define PC_FILTER_H

#include "pc_model.h"
#include "pc_sample.h"

/* z = (x, alpha). */
#define PC_EXTENDED (PC_ORDER + 1)

/* B_d(alpha) and C_vol(alpha) with their derivatives by alpha, (E9), (E10). */
typedef struct {
  pc_real input[PC_ORDER];
  pc_real input_slope[PC_ORDER];
  pc_real volume[PC_ORDER];
  pc_real volume_slope[PC_ORDER];
} pc_matrices;

typedef struct {
  pc_real state[PC_ORDER];                      /* x */
  pc_real alpha;                                /* absorption factor, 1 */
  pc_real covariance[PC_EXTENDED][PC_EXTENDED]; /* P, of (x, alpha) */
  pc_matrices matrices;                         /* at alpha */
  int doublings;                                /* r of the outlier gate, (E25) */
} pc_filter;

/* The model at an absorption factor. */
void pc_evaluate(pc_real alpha, pc_matrices* out);

/* x <- A_d x. */
void pc_propagate(pc_real state[PC_ORDER]);

/* Tissue exactly at ambient, and the initial absorption factor. */
void pc_filter_reset(pc_filter* filter);

/* Time update over one period with `power`, W, (E15). */
void pc_filter_predict(pc_filter* filter, pc_real power);

/* Measurement update with the volume temperature at the end of that period, K, (E16), (E17),
 * (E25). */
pc_sample_use pc_filter_update(pc_filter* filter, pc_real volume_temperature);

/* C_peak x, K. */
pc_real pc_filter_peak(const pc_filter* filter);

/* Standard deviation of C_peak x, K. */
pc_real pc_filter_peak_sigma(const pc_filter* filter);

#endif
