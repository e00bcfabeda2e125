/* Posterior of several uncertain quantities of an eye from all samples so far, (U1), (U2) of
 * docs/uncertainty.md of photocoag: maximum a posteriori with Laplace's covariance. The modes
 * follow from the powers; the uncertainty is in the residues of the outputs. Sums of large
 * numbers that nearly cancel are stored as differences, and squares as square roots, so that
 * single precision suffices.
 * Units: SI; temperatures are rises over ambient, K. Bounded loops, no heap, no globals. */
#ifndef PC_FILTER_H
#define PC_FILTER_H

#include "pc_model.h"
#include "pc_sample.h"

/* R(ln q), K/J, and, row by row, their derivatives with respect to ln q. */
typedef struct {
  pc_real value[PC_ORDER];
  pc_real slope[PC_QUANTITIES][PC_ORDER];
} pc_residues;

/* Input of the state below, K/W. */
typedef struct {
  pc_real input[PC_ORDER];
} pc_matrices;

typedef struct {
  pc_real state[PC_ORDER]; /* K, R_peak,i x_i */
  pc_matrices matrices;
  pc_real alpha;                               /* absorption factor, 1 */
  pc_real modes[PC_ORDER];                     /* x, J, of all powers so far */
  pc_real estimate[PC_QUANTITIES];             /* of ln q minus the prior mean */
  pc_real joint[PC_QUANTITIES][PC_QUANTITIES]; /* its covariance */
  pc_real evaluated_at[PC_QUANTITIES];         /* where the slopes were evaluated */
  pc_residues peak;
  pc_residues sample;               /* of the volume, calibration included */
  pc_real root[PC_ORDER][PC_ORDER]; /* S, upper triangular: S' S = sum x x' */
  pc_real remaining[PC_ORDER];      /* sum x (y - r' x), r the residues of the sample */
  pc_real squares;                  /* sum (y - r' x)^2 */
  pc_real samples;
  pc_real noise; /* K, standard deviation of a sample, from the residuals so far */
  int doublings; /* r of the outlier gate, (E25) */
} pc_filter;

/* Residues of peak and sample; `at`: ln q minus the prior mean. */
void pc_evaluate(const pc_real at[PC_QUANTITIES], pc_residues* peak, pc_residues* sample);

/* x <- decay x. */
void pc_propagate(pc_real state[PC_ORDER]);

/* Tissue at ambient, and the prior. */
void pc_filter_reset(pc_filter* filter);

/* Time update over one period with `power`, W. */
void pc_filter_predict(pc_filter* filter, pc_real power);

/* Measurement update with the volume temperature at the end of that period, K. */
pc_sample_use pc_filter_update(pc_filter* filter, pc_real volume_temperature);

/* s^2 = g' P g, the variance of R_peak' x for modes x, K2. */
pc_real pc_filter_variance(const pc_filter* filter, const pc_real modes[PC_ORDER]);

/* Peak, K. */
pc_real pc_filter_peak(const pc_filter* filter);

/* Its standard deviation, K. */
pc_real pc_filter_peak_sigma(const pc_filter* filter);

#endif
