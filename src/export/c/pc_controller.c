/* One period of the controller, see pc_controller.h. Research software, not a medical device; the
 * supervisor is not in it. */
#include "pc_controller.h"

#include "pc_margin.h"
#include "pc_math.h"

/* The period count saturates here, beyond every key of the configuration. */
#define PC_LAST_CYCLE INT32_C(1000000000)

/* --- What changes with time ------------------------------------------------------------------- */

/* Share of reference and limit in force at the end of period n. */
static pc_real share_at(int32_t n) {
#if PC_SHARES > 0
  const int32_t i = n < 1 ? 1 : (n > PC_SHARES ? PC_SHARES : n);
  return pc_shares[i - 1];
#else
  (void)n;
  return 1;
#endif
}

/* y_ref at the end of period n, K: linear between its points, constant beyond the last. */
static pc_real reference_at(int32_t n) {
  pc_real reference = PC_PEAK_REFERENCE;
#if PC_REFERENCE_POINTS > 0
  for (int i = 0; i < PC_REFERENCE_POINTS; ++i) {
    const pc_reference_point* p = &pc_reference[i];
    const pc_real elapsed = (pc_real)(n - p->period) - p->fraction; /* periods since the point */
    if (i > 0 && elapsed < 0) break;
    reference = p->value + p->slope * pc_max(elapsed, 0);
  }
#endif
  return share_at(n) * reference;
}

/* R0(n + k) of the cost, (E18). */
#define PC_WAIVED 3
static pc_real state_weight(int32_t stage) {
#if PC_DELAYED_WEIGHT
  return stage >= 1 && stage <= PC_WAIVED ? 0 : 1;
#else
  (void)stage;
  return 1;
#endif
}

/* (E21): the steady-state power of the reference of period n. */
static pc_real steady_power(const pc_real input[PC_ORDER], int32_t n) {
  return reference_at(n) / pc_dot(pc_steady_row, input, PC_ORDER);
}

/* --- The quadratic program, (E19), (E20), (E22) ----------------------------------------------- */

/* Outputs without inputs, impulse response and limits; true if the limit had to be relaxed. */
static bool respond(pc_controller* c, int32_t n) {
  const pc_real* B = c->filter.matrices.input;
  pc_qp_problem* problem = &c->problem;
  pc_real least_sum = 0;
  bool relaxed = false;
#if PC_CERTIFIED
  pc_margin margin;
  pc_margin_evaluate(c, &margin);
#endif
  for (int k = 0; k < PC_INPUTS; ++k) {
    c->impulse[k] = pc_dot(pc_peak_rows[k], B, PC_ORDER) * PC_POWER_MAX;
    c->free[k] = pc_dot(pc_peak_rows[k + 1], c->state, PC_ORDER);
    pc_real row_free = c->free[k];
#if PC_CERTIFIED
    c->row_impulse[k] =
        pc_dot(pc_peak_rows[k], margin.input, PC_ORDER) * PC_POWER_MAX + margin.impulse[k];
    row_free += margin.free[k];
#else
    c->row_impulse[k] = c->impulse[k];
#endif
#if PC_CHANCE
    row_free += c->margin[k];
#endif
    least_sum += c->row_impulse[k];
    const pc_real least = row_free + least_sum * (PC_POWER_MIN / PC_POWER_MAX);
    const pc_real limit = share_at(n + k + 1) * PC_PEAK_MAX;
    relaxed = relaxed || least > limit;
    problem->limit[k] = (least > limit ? least : limit) - row_free;
  }
  return relaxed;
}

/* H = 2 (G' W G + r1 I + r2 D'D), G the lower triangular Toeplitz matrix of the impulse response.
 * While W = I an entry is the one below it on its diagonal and one term more. */
static void fill_hessian(pc_controller* c, int32_t n) {
  pc_qp_problem* problem = &c->problem;
  const pc_real* h = c->impulse;
  bool all_one = true;
#if PC_DELAYED_WEIGHT
  for (int k = 0; k < PC_INPUTS; ++k) all_one = all_one && state_weight(n + k + 1) > 0;
#else
  (void)n;
#endif
  for (int d = 0; d < PC_INPUTS; ++d) {
    pc_real sum = 0;
    for (int j = PC_INPUTS - 1; j >= d; --j) {
      if (all_one) {
        sum += h[PC_INPUTS - 1 - j] * h[PC_INPUTS - 1 - j + d];
      } else {
        sum = 0;
        for (int l = 0; l < PC_INPUTS - j; ++l)
          sum += state_weight(n + l + j + 1) * h[l] * h[l + d];
      }
      problem->hessian[j - d][j] = 2 * sum;
      problem->hessian[j][j - d] = 2 * sum;
    }
  }
  for (int j = 0; j < PC_INPUTS; ++j) {
    problem->hessian[j][j] += 2 * PC_R1 + (j + 1 < PC_INPUTS ? 4 : 2) * PC_R2;
    if (j == 0) continue;
    problem->hessian[j - 1][j] -= 2 * PC_R2;
    problem->hessian[j][j - 1] -= 2 * PC_R2;
  }
}

/* g = 2 (G' W (f - y_ref) - r1 u_ref / u_max 1 - r2 u_prev / u_max e_0). */
static void fill_gradient(pc_controller* c, int32_t n) {
  pc_real error[PC_INPUTS];
  for (int k = 0; k < PC_INPUTS; ++k) {
    error[k] = state_weight(n + k + 1) * (c->free[k] - reference_at(n + k + 1));
  }
  for (int j = 0; j < PC_INPUTS; ++j) {
    const pc_real sum = pc_dot(c->impulse, &error[j], PC_INPUTS - j);
    c->problem.gradient[j] = 2 * (sum - PC_R1 * c->decision.power_reference / PC_POWER_MAX);
  }
  c->problem.gradient[0] -= 2 * PC_R2 * c->before / PC_POWER_MAX;
}

/* Fills the problem in u / u_max; true if the limit had to be relaxed. */
static bool condense(pc_controller* c, int32_t n) {
  const bool relaxed = respond(c, n);
  fill_hessian(c, n);
  fill_gradient(c, n);
  for (int k = 0; k < PC_INPUTS; ++k) {
    c->problem.lower[k] = PC_POWER_MIN / PC_POWER_MAX;
    c->problem.upper[k] = 1;
    for (int j = 0; j < PC_INPUTS; ++j) {
      c->problem.rows[k][j] = j <= k ? c->row_impulse[k - j] : 0;
    }
  }
  return relaxed;
}

#if PC_SINGLE && PC_DELAYED_WEIGHT
/* While some R0 are 0, H is too ill-conditioned for single precision. The same problem shifted to
 * its solution v has a small solution, which corrects v:
 *   f <- f + G v,  g <- g(f) + 2 (r1 I + r2 D'D) v,  bounds and limits reduced by the share of v.
 */
static void correct(pc_controller* c, int32_t n) {
  pc_qp_problem* problem = &c->problem;
  pc_real v[PC_INPUTS];
  for (int k = 0; k < PC_INPUTS; ++k) {
    v[k] = c->plan.power[k];
    for (int j = 0; j <= k; ++j) c->free[k] += c->impulse[k - j] * v[j];
    problem->limit[k] -= pc_dot(problem->rows[k], v, k + 1);
    problem->lower[k] -= v[k];
    problem->upper[k] -= v[k];
  }
  fill_gradient(c, n);
  for (int j = 0; j < PC_INPUTS; ++j) {
    pc_real change = v[j] - (j > 0 ? v[j - 1] : 0);
    if (j + 1 < PC_INPUTS) change += v[j] - v[j + 1];
    problem->gradient[j] += 2 * (PC_R1 * v[j] + PC_R2 * change);
  }
  pc_qp_solve(problem, &c->workspace, &c->plan);
  for (int k = 0; k < PC_INPUTS; ++k) {
    if (c->plan.status == PC_QP_SOLVED) v[k] += c->plan.power[k];
    c->plan.power[k] = pc_clamp(v[k], PC_POWER_MIN / PC_POWER_MAX, 1);
  }
}
#endif

/* --- One period ------------------------------------------------------------------------------- */

/* The plan; true if the limit had to be relaxed. */
static bool plan(pc_controller* c, int32_t n) {
#if PC_CHANCE
  bool relaxed = false;
  pc_margin_begin(c);
  for (int i = 0; i < PC_MOST_SOLVES; ++i) {
    const bool same = pc_margin_evaluate(c) <= PC_SAME_LIMIT;
    if (i > 0 && same) break;
    relaxed = i == 0 ? condense(c, n) : respond(c, n);
    const bool solved = pc_qp_solve(&c->problem, &c->workspace, &c->plan) == PC_QP_SOLVED;
    for (int k = 0; k < PC_INPUTS; ++k) {
      c->around[k] = solved ? c->plan.power[k] * PC_POWER_MAX : 0;
    }
  }
#else
  const bool relaxed = condense(c, n);
  pc_qp_solve(&c->problem, &c->workspace, &c->plan);
#endif
  return relaxed;
}

/* A new plan from the state when its first power begins to act. */
static void solve(pc_controller* c) {
  const pc_real* B = c->filter.matrices.input;
  const int32_t n = c->cycle + PC_DELAY;
  for (int i = 0; i < PC_ORDER; ++i) c->state[i] = c->filter.state[i];
#if PC_DELAY
  pc_propagate(c->state);
  pc_axpy(c->pending_power, B, c->state, PC_ORDER);
  c->before = c->pending_power;
#else
  c->before = c->previous_power;
#endif
  pc_decision* decision = &c->decision;
  decision->power_reference = steady_power(B, n);
  if (!c->started) c->before = decision->power_reference; /* u_prev of the first decision */
  const bool relaxed = plan(c, n);
  const pc_qp_status status = c->plan.status;
  decision->changes = c->plan.changes;
  decision->limit_active = false;
  for (int k = 0; k < PC_INPUTS; ++k) {
    decision->limit_active = decision->limit_active || c->plan.row_multiplier[k] > 0;
  }
  if (status == PC_QP_SOLVED) {
    decision->status = relaxed ? PC_RELAXED : PC_SOLVED;
  } else {
    decision->status = status == PC_QP_KKT_FAILED ? PC_KKT_FAILED : PC_FAILED;
  }
#if PC_SINGLE && PC_DELAYED_WEIGHT
  if (status == PC_QP_SOLVED && n < PC_WAIVED) correct(c, n);
#endif
}

/* (E23): the last check before the laser. */
static pc_real gate(pc_real power, pc_gate* verdict) {
  const pc_real excess = power - PC_POWER_MAX;
  *verdict = PC_PASSED;
  if (!pc_finite(power)) {
    *verdict = PC_NOT_FINITE;
  } else if (power < 0 || excess > PC_GATE_ROUNDING * PC_POWER_MAX) {
    *verdict = PC_OUTSIDE;
  }
  if (*verdict != PC_PASSED) return 0;
  return excess > 0 ? PC_POWER_MAX : power;
}

#if PC_IDENTIFICATION > 0
/* The identification phase: for a time, or until the next peak is known accurately enough. */
static bool identifying(pc_controller* c) {
  if (c->cycle >= PC_IDENTIFICATION || c->known) return false;
  c->known = c->started && c->relative_sigma * PC_PEAK_REFERENCE < PC_IDENTIFICATION_SIGMA;
  return !c->known;
}
#endif

static pc_real decide(pc_controller* c) {
  pc_decision* decision = &c->decision;
  if (c->stage == 0) {
    solve(c);
  } else {
    decision->changes = 0;
  }
  const bool solved = decision->status == PC_SOLVED || decision->status == PC_RELAXED;
  pc_real power = solved ? c->plan.power[c->stage] * PC_POWER_MAX : 0;
#if PC_FIRST_POWER_GIVEN
  if (!c->started) power = PC_FIRST_POWER;
#endif
#if PC_IDENTIFICATION > 0
  if (identifying(c)) power = pc_min(power, PC_IDENTIFICATION_POWER);
#endif
  c->started = true;
  c->stage = c->stage + 1 < PC_SOLVE_EVERY ? c->stage + 1 : 0;
  decision->power = gate(power, &decision->gate);
  c->previous_power = decision->power;
  c->pending_power = decision->power;
  return decision->power;
}

static void observe(pc_controller* c, pc_real volume_temperature, pc_real applied_power) {
  c->previous_power = applied_power;
  if (c->cycle < PC_LAST_CYCLE) ++c->cycle;
  pc_filter_predict(&c->filter, applied_power);
#if PC_CERTIFIED
  pc_margin_observe(c, applied_power);
#endif
  c->decision.sample = pc_filter_update(&c->filter, volume_temperature);
}

void pc_controller_init(pc_controller* controller) {
  const pc_controller fresh = {0};
  *controller = fresh;
  pc_filter_reset(&controller->filter);
  controller->decision.status = PC_FAILED;
  controller->decision.sample = PC_NO_SAMPLE;
}

pc_real pc_controller_start(pc_controller* controller) { return decide(controller); }

/* A period with a bad input counts as one without a sample and ends with 0 W. */
static pc_real advance(pc_controller* c, pc_real volume_temperature, pc_real applied_power,
                       bool good) {
  observe(c, volume_temperature, pc_finite(applied_power) ? applied_power : c->decision.power);
  if (good) return decide(c);
  c->stage = 0;
  c->started = true;
  c->decision.status = PC_BAD_INPUT;
  c->decision.power = 0;
  c->previous_power = 0;
  c->pending_power = 0;
  return 0;
}

pc_real pc_controller_step(pc_controller* controller, pc_real volume_temperature,
                           pc_real applied_power) {
  const bool good = pc_finite(volume_temperature) && pc_finite(applied_power);
  return advance(controller, good ? volume_temperature : (pc_real)NAN, applied_power, good);
}

pc_real pc_controller_step_without_sample(pc_controller* controller, pc_real applied_power) {
  return advance(controller, (pc_real)NAN, applied_power, pc_finite(applied_power));
}

pc_real pc_controller_peak(const pc_controller* controller) {
  return pc_filter_peak(&controller->filter);
}

pc_real pc_controller_peak_sigma(const pc_controller* controller) {
  return pc_filter_peak_sigma(&controller->filter);
}
