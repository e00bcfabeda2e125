/* The margins of the peak limit, see pc_margin.h. */
#include "pc_margin.h"

#include "pc_math.h"

#if PC_CERTIFIED
/* The certificate's scale is linear between its nodes: its largest value between low and high is
 * at a node or at an end, and the node next to an end is at least as far out. */
static pc_real scale_at(pc_real alpha) {
  pc_real scale = pc_certificate_scale[0];
  for (int i = 0; i + 1 < PC_CERTIFICATE_NODES; ++i) {
    const pc_real beyond = alpha - pc_certificate_alpha[i];
    const pc_real step = pc_certificate_alpha[i + 1] - pc_certificate_alpha[i];
    if (!(beyond > 0)) break;
    scale = pc_certificate_scale[i] +
            pc_min(beyond / step, 1) * (pc_certificate_scale[i + 1] - pc_certificate_scale[i]);
  }
  return scale;
}
static pc_real largest_scale(pc_real low, pc_real high) {
  pc_real largest = pc_max(scale_at(low), scale_at(high));
  for (int i = 0; i < PC_CERTIFICATE_NODES; ++i) {
    if (pc_certificate_alpha[i] > low && pc_certificate_alpha[i] < high)
      largest = pc_max(largest, pc_certificate_scale[i]);
  }
  return largest;
}

void pc_margin_observe(pc_controller* c, pc_real power) {
  for (int j = 0; j < PC_MAJORANT_TERMS; ++j) {
    c->applied[j] = pc_majorant_decay[j] * c->applied[j] + pc_max(power, 0);
  }
}

void pc_margin_evaluate(const pc_controller* c, pc_margin* margin) {
  const pc_filter* filter = &c->filter;
  const pc_real variance = filter->covariance[PC_ORDER][PC_ORDER];
  const pc_real spread = PC_ROBUST_SIGMA * (variance > 0 ? pc_sqrt(variance) : 0);
  const pc_real high = pc_max(filter->alpha, pc_min(filter->alpha + spread, PC_ALPHA_MAX));
  const pc_real scale = largest_scale(filter->alpha - spread, high);
  pc_matrices matrices;
  pc_evaluate(high, &matrices);
  for (int i = 0; i < PC_ORDER; ++i) margin->input[i] = matrices.input[i];

  for (int k = 0; k < PC_INPUTS; ++k) {
    const pc_real* row = pc_peak_rows[k + 1];
    pc_real peak_variance = 0;
    for (int i = 0; i < PC_ORDER; ++i) {
      peak_variance += row[i] * pc_dot(filter->covariance[i], row, PC_ORDER);
    }
    const pc_real sigma = peak_variance > 0 ? pc_sqrt(peak_variance) : 0;
    pc_real left = 0;   /* of the powers applied so far, at stage k + 1 */
    pc_real caused = 0; /* by a power k + 1 periods earlier */
    for (int j = 0; j < PC_MAJORANT_TERMS; ++j) {
#if PC_DELAY
      left += pc_majorant[k + 1][j] * (pc_majorant_decay[j] * c->applied[j] + c->pending_power);
#else
      left += pc_majorant[k + 1][j] * c->applied[j];
#endif
      caused += pc_majorant[k][j];
    }
    margin->free[k] = PC_ROBUST_SIGMA * sigma + scale * left;
#if PC_DELAY
    /* Heating of the pending power beyond the estimate. */
    pc_real excess = 0;
    for (int i = 0; i < PC_ORDER; ++i) {
      excess += row[i] * (margin->input[i] - filter->matrices.input[i]) * c->pending_power;
    }
    margin->free[k] += pc_max(excess, 0);
#endif
    margin->impulse[k] = scale * caused * PC_POWER_MAX;
  }
}
#endif

#if PC_CHANCE
pc_real pc_margin_evaluate(pc_controller* c) {
  pc_real modes[PC_ORDER];
  pc_real change = 0;
  for (int i = 0; i < PC_ORDER; ++i) modes[i] = c->ahead[i];
  for (int k = 0; k < PC_INPUTS; ++k) {
    pc_propagate(modes);
    pc_axpy(c->around[k], pc_gain, modes, PC_ORDER);
    const pc_real peak = pc_dot(c->filter.peak.value, modes, PC_ORDER);
    pc_real relative = 0; /* no uncertainty without heat */
    if (peak > 0) {
      const pc_real variance = pc_filter_variance(&c->filter, modes);
      relative = pc_sqrt(variance / (peak * peak) + PC_PEAK_ERROR * PC_PEAK_ERROR);
    }
    if (k == 0) c->relative_sigma = relative;
    const pc_real kept = PC_PEAK_MAX * -pc_expm1(-PC_KAPPA * relative);
    change = pc_max(change, pc_abs(kept - c->margin[k]));
    c->margin[k] = kept;
  }
  return change;
}

void pc_margin_begin(pc_controller* c) {
  bool finite = c->started;
  for (int k = 0; k < PC_INPUTS; ++k) {
    const int next = k + PC_SOLVE_EVERY;
    c->around[k] = c->around[next < PC_INPUTS ? next : PC_INPUTS - 1];
    finite = finite && pc_finite(c->around[k]);
  }
  for (int k = 0; !finite && k < PC_INPUTS; ++k) c->around[k] = c->before;
  for (int i = 0; i < PC_ORDER; ++i) c->ahead[i] = c->filter.modes[i];
#if PC_DELAY
  pc_propagate(c->ahead);
  pc_axpy(c->pending_power, pc_gain, c->ahead, PC_ORDER);
#endif
}
#endif
