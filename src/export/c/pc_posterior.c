/* Maximum a posteriori estimate of the uncertain quantities, see the header. */
#include "pc_filter.h"

/* Gauss-Newton steps per sample: the first samples change the estimate most. */
#define PC_MOST_STEPS 4
/* Another step follows if the last one exceeded this fraction of the standard deviation. */
#define PC_SMALL_STEP PC_R(0.05)
/* Residues are linear to a relative error of 1e-4 within this change of ln q. */
#define PC_LINEAR PC_R(0.01)

/* --- Residues, (U1) --------------------------------------------------------------------------- */

/* Values and slopes by x of T_0 ... T_PC_DEGREE for every quantity. */
typedef struct {
  pc_real value[PC_QUANTITIES][PC_DEGREE + 1];
  pc_real slope[PC_QUANTITIES][PC_DEGREE + 1];
} chebyshev;

static void fill_chebyshev(const pc_real inside[PC_QUANTITIES], chebyshev* T) {
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    const pc_range* r = &pc_ranges[v];
    const pc_real x = r->centre + r->scale * inside[v];
    T->value[v][0] = 1;
    T->slope[v][0] = 0;
    T->value[v][1] = x;
    T->slope[v][1] = 1;
    for (int d = 2; d <= PC_DEGREE; ++d) {
      T->value[v][d] = 2 * x * T->value[v][d - 1] - T->value[v][d - 2];
      T->slope[v][d] = 2 * T->value[v][d - 1] + 2 * x * T->slope[v][d - 1] - T->slope[v][d - 2];
    }
  }
}

/* The sums become residues: times the power law, and the chain rule. */
static void finish(pc_residues* of, const pc_real exponents[PC_QUANTITIES],
                   const pc_real inside[PC_QUANTITIES]) {
  pc_real power = 0;
  for (int v = 0; v < PC_QUANTITIES; ++v) power += exponents[v] * inside[v];
  const pc_real factor = pc_exp(power);
  for (int i = 0; i < PC_ORDER; ++i) of->value[i] *= factor;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    const pc_real chain = factor * pc_ranges[v].scale;
    for (int i = 0; i < PC_ORDER; ++i) {
      of->slope[v][i] = chain * of->slope[v][i] + exponents[v] * of->value[i];
    }
  }
}

static void clear(pc_residues* of) {
  for (int i = 0; i < PC_ORDER; ++i) of->value[i] = 0;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    for (int i = 0; i < PC_ORDER; ++i) of->slope[v][i] = 0;
  }
}

/* R_i = e^(g' (ln q - m)) sum_t c_it psi_t; psi_t is the product of the term's Chebyshev
 * polynomials. */
void pc_evaluate(const pc_real at[PC_QUANTITIES], pc_residues* peak, pc_residues* sample) {
  chebyshev T;
  pc_real inside[PC_QUANTITIES];
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    inside[v] = pc_clamp(at[v], pc_ranges[v].low, pc_ranges[v].high);
  }
  fill_chebyshev(inside, &T);
  clear(peak);
  clear(sample);
  const pc_factor* factor = pc_factors;
  for (int t = 0; t < PC_POLYNOMIALS; ++t) {
    pc_real psi = 1;
    pc_real slope[PC_MOST_FACTORS]; /* by x of the factors' quantities */
    const int count = pc_factor_counts[t];
    for (int k = 0; k < count; ++k) {
      const pc_real value = T.value[factor[k].quantity][factor[k].degree];
      for (int before = 0; before < k; ++before) slope[before] *= value;
      slope[k] = psi * T.slope[factor[k].quantity][factor[k].degree];
      psi *= value;
    }
    pc_axpy(psi, pc_peak_terms[t], peak->value, PC_ORDER);
    pc_axpy(psi, pc_volume_coefficients[t], sample->value, PC_ORDER);
    for (int k = 0; k < count; ++k) {
      pc_axpy(slope[k], pc_peak_terms[t], peak->slope[factor[k].quantity], PC_ORDER);
      pc_axpy(slope[k], pc_volume_coefficients[t], sample->slope[factor[k].quantity], PC_ORDER);
    }
    factor += count;
  }
  finish(peak, pc_peak_exponents, inside);
  finish(sample, pc_volume_exponents, inside);
#if PC_CALIBRATION >= 0
  /* A sample is the calibration times the volume temperature. */
  const pc_real calibration = pc_exp(at[PC_CALIBRATION]);
  for (int i = 0; i < PC_ORDER; ++i) sample->value[i] *= calibration;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    for (int i = 0; i < PC_ORDER; ++i) {
      sample->slope[v][i] =
          v == PC_CALIBRATION ? sample->value[i] : calibration * sample->slope[v][i];
    }
  }
#endif
}

static void evaluate(pc_filter* filter) {
  for (int v = 0; v < PC_QUANTITIES; ++v) filter->evaluated_at[v] = filter->estimate[v];
  pc_evaluate(filter->estimate, &filter->peak, &filter->sample);
}

/* --- The estimate, (U2) ----------------------------------------------------------------------- */

void pc_propagate(pc_real state[PC_ORDER]) {
  for (int i = 0; i < PC_ORDER; ++i) state[i] *= pc_transition[i];
}

/* Updates the members that the controller reads. */
static void publish(pc_filter* filter) {
  for (int i = 0; i < PC_ORDER; ++i) {
    filter->state[i] = filter->peak.value[i] * filter->modes[i];
    filter->matrices.input[i] = filter->peak.value[i] * pc_gain[i];
  }
}

void pc_filter_reset(pc_filter* filter) {
  const pc_filter fresh = {0};
  *filter = fresh;
  filter->noise = PC_NOISE;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    for (int w = 0; w < PC_QUANTITIES; ++w) filter->joint[v][w] = pc_prior_covariance[v][w];
  }
  filter->alpha = pc_exp(pc_prior_mean[0]);
  evaluate(filter);
  publish(filter);
}

void pc_filter_predict(pc_filter* filter, pc_real power) {
  pc_propagate(filter->modes);
  pc_axpy(power, pc_gain, filter->modes, PC_ORDER);
  publish(filter);
}

/* R' R <- R' R + row row' by rotations, R upper triangular; `row` does not keep its content. */
static void add_row(pc_real* R, pc_real* row, int size) {
  for (int k = 0; k < size; ++k) {
    pc_real* r = &R[k * size];
    const pc_real length = pc_sqrt(r[k] * r[k] + row[k] * row[k]);
    if (!(length > 0)) continue;
    const pc_real c = r[k] / length;
    const pc_real s = row[k] / length;
    r[k] = length;
    for (int j = k + 1; j < size; ++j) {
      const pc_real old = r[j];
      r[j] = c * old + s * row[j];
      row[j] = c * row[j] - s * old;
    }
  }
}

/* joint <- (P0^-1 + J' S' S J / noise^2)^-1 by its square root. */
static void evaluate_covariance(pc_filter* filter) {
  pc_real R[PC_QUANTITIES][PC_QUANTITIES];
  pc_real row[PC_QUANTITIES];
  const pc_real weight = 1 / filter->noise;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    for (int w = 0; w < PC_QUANTITIES; ++w) R[v][w] = pc_prior_root[v][w];
  }
  for (int i = 0; i < PC_ORDER; ++i) {
    for (int v = 0; v < PC_QUANTITIES; ++v) {
      row[v] = weight * pc_dot(&filter->root[i][i], &filter->sample.slope[v][i], PC_ORDER - i);
    }
    add_row(R[0], row, PC_QUANTITIES);
  }
  /* R^-1 in the same place, then R^-1 R^-T. */
  for (int j = 0; j < PC_QUANTITIES; ++j) {
    R[j][j] = 1 / R[j][j];
    for (int i = 0; i < j; ++i) {
      pc_real sum = 0;
      for (int k = i; k < j; ++k) sum += R[i][k] * R[k][j];
      R[i][j] = -sum * R[j][j];
    }
  }
  for (int i = 0; i < PC_QUANTITIES; ++i) {
    for (int j = 0; j <= i; ++j) {
      filter->joint[i][j] = pc_dot(&R[i][i], &R[j][i], PC_QUANTITIES - i);
      filter->joint[j][i] = filter->joint[i][j];
    }
  }
}

/* step <- -joint times the gradient of the cost, P0^-1 (ln q - m) - J' sum x (y - r' x) / noise^2.
 */
static void find_step(const pc_filter* filter, pc_real step[PC_QUANTITIES]) {
  const pc_real weight = 1 / (filter->noise * filter->noise);
  pc_real downhill[PC_QUANTITIES];
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    downhill[v] = weight * pc_dot(filter->sample.slope[v], filter->remaining, PC_ORDER) -
                  pc_dot(pc_prior_information[v], filter->estimate, PC_QUANTITIES);
  }
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    step[v] = pc_dot(filter->joint[v], downhill, PC_QUANTITIES);
  }
}

/* The sums of what is left, now that the residues of the sample are `before` no more: with d their
 * change, sum x (y - r' x) less M d, sum (y - r' x)^2 less 2 d' sum x (y - r' x) plus d' M d. */
static void follow_residues(pc_filter* filter, const pc_real before[PC_ORDER]) {
  pc_real change[PC_ORDER];
  for (int i = 0; i < PC_ORDER; ++i) change[i] = filter->sample.value[i] - before[i];
  pc_real curved = -2 * pc_dot(change, filter->remaining, PC_ORDER);
  for (int i = 0; i < PC_ORDER; ++i) {
    const pc_real scaled = pc_dot(&filter->root[i][i], &change[i], PC_ORDER - i);
    curved += scaled * scaled;
    pc_axpy(-scaled, &filter->root[i][i], &filter->remaining[i], PC_ORDER - i);
  }
  filter->squares += curved;
}

/* One Gauss-Newton step and the covariance before it. True if it was large. */
static bool improve(pc_filter* filter) {
  pc_real step[PC_QUANTITIES];
  pc_real before[PC_ORDER];
  evaluate_covariance(filter);
  find_step(filter, step);
  /* At most one prior standard deviation at a time: beyond, the linearization is poor. */
  pc_real most = 1;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    most = pc_max(most, pc_abs(step[v]) / pc_sqrt(pc_prior_covariance[v][v]));
  }
  for (int i = 0; i < PC_ORDER; ++i) before[i] = filter->sample.value[i];
  pc_real moved = 0;
  pc_real far = 0;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    const pc_real next =
        pc_clamp(filter->estimate[v] + step[v] / most, pc_ranges[v].low, pc_ranges[v].high);
    step[v] = next - filter->estimate[v];
    moved = pc_max(moved, pc_abs(step[v]) / pc_sqrt(filter->joint[v][v]));
    far = pc_max(far, pc_abs(next - filter->evaluated_at[v]));
    filter->estimate[v] = next;
  }
  if (far > PC_LINEAR) {
    evaluate(filter);
  } else {
    for (int v = 0; v < PC_QUANTITIES; ++v) {
      pc_axpy(step[v], filter->peak.slope[v], filter->peak.value, PC_ORDER);
      pc_axpy(step[v], filter->sample.slope[v], filter->sample.value, PC_ORDER);
    }
  }
  follow_residues(filter, before);
  return moved > PC_SMALL_STEP;
}

/* Variance of the residuals; the prior counts as PC_NOISE_SAMPLES further samples. */
static void judge_noise(pc_filter* filter) {
#if PC_NOISE_LEARNED
  pc_real used = PC_QUANTITIES;
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    used -= pc_dot(pc_prior_information[v], filter->joint[v], PC_QUANTITIES);
  }
  filter->noise = pc_sqrt((PC_NOISE_SAMPLES * PC_NOISE * PC_NOISE + pc_max(0, filter->squares)) /
                          (PC_NOISE_SAMPLES + pc_max(0, filter->samples - used)));
#else
  (void)filter;
#endif
}

static bool healthy(const pc_filter* filter) {
  pc_real zero = 0 * (filter->noise + filter->squares);
  for (int i = 0; i < PC_ORDER; ++i) {
    zero += 0 * filter->state[i] + 0 * filter->sample.value[i] + 0 * filter->remaining[i];
    for (int j = i; j < PC_ORDER; ++j) zero += 0 * filter->root[i][j];
  }
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    zero += 0 * filter->estimate[v];
    for (int w = 0; w < PC_QUANTITIES; ++w) zero += 0 * filter->joint[v][w];
  }
  return zero == 0 && filter->noise > 0; /* 0 times what is not finite is NaN */
}

/* Covariance of ln q: considered quantities keep that of the prior. */
static pc_real covariance(const pc_filter* filter, int v, int w) {
#if PC_CONSIDERED
  if (!pc_ranges[v].estimated && !pc_ranges[w].estimated) return pc_prior_covariance[v][w];
#endif
  return filter->joint[v][w];
}

pc_sample_use pc_filter_update(pc_filter* filter, pc_real volume_temperature) {
  if (!pc_possible_sample(volume_temperature)) return PC_NO_SAMPLE;
  const pc_real* x = filter->modes;
  pc_real row[PC_QUANTITIES];
  pc_real powers[PC_ORDER];
  pc_real variance = 0;
  for (int v = 0; v < PC_QUANTITIES; ++v) row[v] = pc_dot(filter->sample.slope[v], x, PC_ORDER);
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    variance += row[v] * pc_dot(filter->joint[v], row, PC_QUANTITIES);
  }
  const pc_real innovation = volume_temperature - pc_dot(filter->sample.value, x, PC_ORDER);
  const pc_real sigma = pc_sqrt(filter->noise * filter->noise + pc_max(0, variance));
  if (!pc_passes_gate(&filter->doublings, innovation, sigma)) return PC_OUTLIER;

  for (int i = 0; i < PC_ORDER; ++i) powers[i] = x[i];
  add_row(filter->root[0], powers, PC_ORDER);
  pc_axpy(innovation, x, filter->remaining, PC_ORDER);
  filter->squares += innovation * innovation;
  filter->samples += 1;
  for (int step = 0; step < PC_MOST_STEPS && improve(filter); ++step) {
  }
  judge_noise(filter);
  if (pc_ranges[0].estimated) filter->alpha = pc_exp(pc_prior_mean[0] + filter->estimate[0]);
  publish(filter);
  if (!healthy(filter)) {
    pc_filter_reset(filter);
    return PC_RESTARTED;
  }
  return PC_UPDATED;
}

pc_real pc_filter_variance(const pc_filter* filter, const pc_real modes[PC_ORDER]) {
  pc_real row[PC_QUANTITIES];
  pc_real variance = 0;
  for (int v = 0; v < PC_QUANTITIES; ++v) row[v] = pc_dot(filter->peak.slope[v], modes, PC_ORDER);
  for (int v = 0; v < PC_QUANTITIES; ++v) {
    for (int w = 0; w < PC_QUANTITIES; ++w) variance += row[v] * covariance(filter, v, w) * row[w];
  }
  return pc_max(0, variance);
}

pc_real pc_filter_peak(const pc_filter* filter) {
  pc_real sum = 0;
  for (int i = 0; i < PC_ORDER; ++i) sum += filter->state[i];
  return sum;
}

pc_real pc_filter_peak_sigma(const pc_filter* filter) {
  return pc_sqrt(pc_filter_variance(filter, filter->modes));
}
