/* Extended Kalman filter of state and absorption factor, see pc_filter.h. */
#include "pc_filter.h"

#include "pc_math.h"

#if PC_THETA_DEIM || PC_VOLUME_NORMALIZED
/* Fraction of the light that is absorbed between two depths, (E3):
 *   s = e^-tau(front) - e^-tau(back),  tau(z) = fixed(z) + alpha scaled(z). */
static void absorbed(const pc_layer* layer, pc_real alpha, pc_real* value, pc_real* slope) {
  const pc_real front = pc_exp(-(layer->fixed_front + alpha * layer->scaled_front));
  const pc_real step = -pc_expm1(-(layer->fixed_step + alpha * layer->scaled_step));
  *value = front * step;
  *slope = front * (layer->scaled_step - (layer->scaled_front + layer->scaled_step) * step);
}
#endif

/* theta_j(alpha) and their derivatives, (E9). */
static void evaluate_theta(pc_real alpha, pc_real value[PC_TERMS], pc_real slope[PC_TERMS]) {
#if PC_THETA_DEIM
  for (int j = 0; j < PC_TERMS; ++j) absorbed(&pc_points[j], alpha, &value[j], &slope[j]);
#else
  /* Polynomials in x by their recurrence and its derivative; Chebyshev's or powers. */
  const pc_real x = (alpha - PC_THETA_CENTER) / PC_THETA_HALF_WIDTH;
  for (int j = 0; j < PC_TERMS; ++j) {
    if (j < 2) {
      value[j] = j == 0 ? 1 : x;
      slope[j] = j == 0 ? 0 : 1;
    } else {
#if PC_THETA_CHEBYSHEV
      value[j] = 2 * x * value[j - 1] - value[j - 2];
      slope[j] = 2 * value[j - 1] + 2 * x * slope[j - 1] - slope[j - 2];
#else
      value[j] = x * value[j - 1];
      slope[j] = value[j - 1] + x * slope[j - 1];
#endif
    }
  }
  for (int j = 0; j < PC_TERMS; ++j) slope[j] /= PC_THETA_HALF_WIDTH;
#endif
}

/* B_d = sum_j theta_j B_j,  C_vol = sum_j theta_j C_j, or that over s_Omega. */
void pc_evaluate(pc_real alpha, pc_matrices* out) {
  pc_real value[PC_TERMS];
  pc_real slope[PC_TERMS];
  evaluate_theta(alpha, value, slope);
  for (int i = 0; i < PC_ORDER; ++i) {
    pc_real input = 0;
    pc_real input_slope = 0;
    pc_real volume = 0;
    pc_real volume_slope = 0;
    for (int j = 0; j < PC_TERMS; ++j) {
      input += value[j] * pc_input_terms[i][j];
      input_slope += slope[j] * pc_input_terms[i][j];
      volume += value[j] * pc_volume_terms[i][j];
      volume_slope += slope[j] * pc_volume_terms[i][j];
    }
    out->input[i] = input;
    out->input_slope[i] = input_slope;
    out->volume[i] = volume;
    out->volume_slope[i] = volume_slope;
  }
#if PC_VOLUME_NORMALIZED
  /* (C / s)' = (C' - (C / s) s') / s */
  pc_real whole = 0;
  pc_real whole_slope = 0;
  absorbed(&pc_whole, alpha, &whole, &whole_slope);
  for (int i = 0; i < PC_ORDER; ++i) {
    out->volume[i] /= whole;
    out->volume_slope[i] = (out->volume_slope[i] - out->volume[i] * whole_slope) / whole;
  }
#endif
}

void pc_propagate(pc_real state[PC_ORDER]) {
#if PC_DIAGONAL
  for (int i = 0; i < PC_ORDER; ++i) state[i] *= pc_transition[i];
#else
  pc_real next[PC_ORDER];
  for (int i = 0; i < PC_ORDER; ++i) next[i] = pc_dot(pc_transition[i], state, PC_ORDER);
  for (int i = 0; i < PC_ORDER; ++i) state[i] = next[i];
#endif
}

void pc_filter_reset(pc_filter* filter) {
  for (int i = 0; i < PC_EXTENDED; ++i) {
    for (int j = 0; j < PC_EXTENDED; ++j) filter->covariance[i][j] = 0;
  }
  for (int i = 0; i < PC_ORDER; ++i) filter->state[i] = 0;
  filter->alpha = PC_ALPHA_INITIAL;
  filter->covariance[PC_ORDER][PC_ORDER] = PC_ALPHA_VARIANCE_INITIAL;
  filter->doublings = 0;
  pc_evaluate(filter->alpha, &filter->matrices);
}

/* P_xx <- A P_xx A', P_xa <- A P_xa. */
static void propagate_covariance(pc_real P[PC_EXTENDED][PC_EXTENDED]) {
#if PC_DIAGONAL
  for (int i = 0; i < PC_ORDER; ++i) {
    for (int j = i; j < PC_ORDER; ++j) {
      P[i][j] *= pc_transition[i] * pc_transition[j];
      P[j][i] = P[i][j];
    }
    P[i][PC_ORDER] *= pc_transition[i];
  }
#else
  pc_real half[PC_ORDER][PC_EXTENDED]; /* A (P_xx, P_xa) */
  for (int i = 0; i < PC_ORDER; ++i) {
    for (int j = 0; j < PC_EXTENDED; ++j) {
      half[i][j] = 0;
      for (int k = 0; k < PC_ORDER; ++k) half[i][j] += pc_transition[i][k] * P[k][j];
    }
  }
  for (int i = 0; i < PC_ORDER; ++i) {
    for (int j = i; j < PC_ORDER; ++j) {
      const pc_real upper = pc_dot(half[i], pc_transition[j], PC_ORDER);
      const pc_real lower = pc_dot(half[j], pc_transition[i], PC_ORDER);
      P[i][j] = P[j][i] = (upper + lower) / 2;
    }
    P[i][PC_ORDER] = half[i][PC_ORDER];
  }
#endif
}

/* (E15): x <- A x + B u,  P <- F P F' + Q,  F = (A, b; 0, 1),  b = B'(alpha) u,
 * Q = diag(s_u^2 B B', s_alpha^2). */
void pc_filter_predict(pc_filter* filter, pc_real power) {
  pc_real(*P)[PC_EXTENDED] = filter->covariance;
  const pc_real* B = filter->matrices.input;
  const pc_real variance = P[PC_ORDER][PC_ORDER];
  pc_real b[PC_ORDER];
  pc_real half[PC_ORDER]; /* A P_xa + s^2 b / 2 */
  for (int i = 0; i < PC_ORDER; ++i) b[i] = filter->matrices.input_slope[i] * power;

  propagate_covariance(P);
  for (int i = 0; i < PC_ORDER; ++i) half[i] = P[i][PC_ORDER] + variance * b[i] / 2;
  for (int i = 0; i < PC_ORDER; ++i) {
    const pc_real noise = PC_POWER_VARIANCE * B[i];
    for (int j = i; j < PC_ORDER; ++j) {
      P[i][j] += half[i] * b[j] + b[i] * half[j] + noise * B[j];
      P[j][i] = P[i][j];
    }
    P[i][PC_ORDER] += variance * b[i];
    P[PC_ORDER][i] = P[i][PC_ORDER];
  }
  P[PC_ORDER][PC_ORDER] += PC_ALPHA_DRIFT_VARIANCE;

  pc_propagate(filter->state);
  pc_axpy(power, B, filter->state, PC_ORDER);
}

/* Joseph form in two rank-one steps, T = (I - K H) P, then P <- T (I - K H)' + noise K K', on one
 * triangle; ph = P H'. */
static void update_covariance(const pc_real h[PC_EXTENDED], const pc_real ph[PC_EXTENDED],
                              const pc_real gain[PC_EXTENDED],
                              pc_real P[PC_EXTENDED][PC_EXTENDED]) {
  pc_real half[PC_EXTENDED]; /* (T H' - noise K) / 2 */
  for (int i = 0; i < PC_EXTENDED; ++i) {
    for (int j = i; j < PC_EXTENDED; ++j) {
      P[i][j] -= gain[i] * ph[j];
      P[j][i] = P[i][j];
    }
  }
  for (int i = 0; i < PC_EXTENDED; ++i) {
    half[i] = (pc_dot(P[i], h, PC_EXTENDED) - PC_SAMPLE_VARIANCE * gain[i]) / 2;
  }
  for (int i = 0; i < PC_EXTENDED; ++i) {
    for (int j = i; j < PC_EXTENDED; ++j) {
      P[i][j] -= half[i] * gain[j] + half[j] * gain[i];
      P[j][i] = P[i][j];
    }
  }
}

/* (E17): alpha moves to its bound, and the state with it along their covariance. */
static void keep_alpha_inside(pc_filter* filter) {
  const pc_real bounded = pc_clamp(filter->alpha, PC_ALPHA_MIN, PC_ALPHA_MAX);
  if (bounded == filter->alpha) return;
  const pc_real variance = filter->covariance[PC_ORDER][PC_ORDER];
  if (variance > 0) {
    pc_axpy((bounded - filter->alpha) / variance, filter->covariance[PC_ORDER], filter->state,
            PC_ORDER);
  }
  filter->alpha = bounded;
}

static bool healthy(const pc_filter* filter) {
  bool positive = true;
  pc_real zero = 0 * (filter->alpha + pc_filter_peak(filter) +
                      pc_dot(filter->matrices.volume, filter->state, PC_ORDER));
  for (int i = 0; i < PC_EXTENDED; ++i) {
    positive = positive && filter->covariance[i][i] >= 0;
    for (int j = i; j < PC_EXTENDED; ++j) zero += 0 * filter->covariance[i][j];
  }
  return positive && zero == 0; /* 0 times what is not finite is NaN */
}

/* (E16): H = (C, C' x),  S = H P H' + s_y^2,  K = P H' / S,  z <- z + K (y - C x). */
pc_sample_use pc_filter_update(pc_filter* filter, pc_real volume_temperature) {
  if (!pc_possible_sample(volume_temperature)) return PC_NO_SAMPLE;
  const pc_matrices* m = &filter->matrices;
  pc_real h[PC_EXTENDED];
  pc_real ph[PC_EXTENDED];
  pc_real gain[PC_EXTENDED];
  for (int i = 0; i < PC_ORDER; ++i) h[i] = m->volume[i];
  h[PC_ORDER] = pc_dot(m->volume_slope, filter->state, PC_ORDER);
  for (int i = 0; i < PC_EXTENDED; ++i) ph[i] = pc_dot(filter->covariance[i], h, PC_EXTENDED);
  const pc_real variance = pc_dot(h, ph, PC_EXTENDED) + PC_SAMPLE_VARIANCE;
  const pc_real innovation = volume_temperature - pc_dot(m->volume, filter->state, PC_ORDER);
  if (!pc_passes_gate(&filter->doublings, innovation, pc_sqrt(variance))) return PC_OUTLIER;

  for (int i = 0; i < PC_EXTENDED; ++i) gain[i] = ph[i] / variance;
  update_covariance(h, ph, gain, filter->covariance);
  pc_axpy(innovation, gain, filter->state, PC_ORDER);
  filter->alpha += gain[PC_ORDER] * innovation;
  keep_alpha_inside(filter);
  pc_evaluate(filter->alpha, &filter->matrices);
  if (!healthy(filter)) {
    pc_filter_reset(filter);
    return PC_RESTARTED;
  }
  return PC_UPDATED;
}

pc_real pc_filter_peak(const pc_filter* filter) {
  return pc_dot(pc_peak_row, filter->state, PC_ORDER);
}

pc_real pc_filter_peak_sigma(const pc_filter* filter) {
  pc_real variance = 0;
  for (int i = 0; i < PC_ORDER; ++i) {
    variance += pc_peak_row[i] * pc_dot(filter->covariance[i], pc_peak_row, PC_ORDER);
  }
  return variance > 0 ? pc_sqrt(variance) : 0;
}
