/* Dual active-set method of Goldfarb and Idnani, see pc_qp.h. Steps 0 to 2 are those of the paper.
 */
#include "pc_qp.h"

#include "pc_math.h"

/* All relative: to the scale of a constraint, to the other terms of a sum. */
#if PC_SINGLE
#define PC_VIOLATED PC_R(1e-6)   /* a constraint is taken up: above rounding */
#define PC_FEASIBLE PC_R(1e-5)   /* rows that cannot be met better than this are infeasible */
#define PC_DEPENDENT PC_R(1e-4)  /* sine of the angle (in H^-1) to the span of the active set */
#define PC_NEGLIGIBLE PC_R(1e-5) /* components of r that may be rounding errors */
#define PC_PIVOT PC_R(1e-6)      /* Cholesky pivot over the diagonal: below, H is not definite */
#define PC_NO_REACH PC_R(1e-6)   /* a row that no u in the box moves */
#else
#define PC_VIOLATED PC_R(1e-13)
#define PC_FEASIBLE PC_R(1e-9)
#define PC_DEPENDENT PC_R(1e-10)
#define PC_NEGLIGIBLE PC_R(1e-12)
#define PC_PIVOT PC_R(1e-14)
#define PC_NO_REACH PC_R(1e-9)
#endif
#define PC_WIDE 10 /* a box counts as at most so much larger than u */
#define PC_LIMIT_ROUNDING (16 * PC_EPSILON)

/* H = L L' (in R, column by column), J = L^-T. False if H is not positive definite. */
static bool factorize(const pc_qp_problem* problem, pc_qp_workspace* w) {
  for (int k = 0; k < PC_INPUTS; ++k) {
    for (int i = k; i < PC_INPUTS; ++i) {
      pc_real sum = problem->hessian[k][i];
      for (int j = 0; j < k; ++j) sum -= w->R[j][k] * w->R[j][i];
      w->R[k][i] = sum;
    }
    if (!(w->R[k][k] > PC_PIVOT * problem->hessian[k][k])) return false;
    const pc_real inverse = 1 / pc_sqrt(w->R[k][k]);
    for (int i = k; i < PC_INPUTS; ++i) w->R[k][i] *= inverse;
  }
  for (int k = 0; k < PC_INPUTS; ++k) {
    for (int i = k + 1; i < PC_INPUTS; ++i) w->J[k][i] = 0;
    w->J[k][k] = 1 / w->R[k][k];
    for (int i = k - 1; i >= 0; --i) {
      w->J[k][i] = -pc_dot(&w->R[i][i + 1], &w->J[k][i + 1], k - i) / w->R[i][i];
    }
  }
  return true;
}

/* Scales the box, and normalizes the rows that some u in the box violates. */
static pc_qp_status prepare(const pc_qp_problem* problem, pc_qp_workspace* w) {
  pc_real* highest = w->d; /* largest G_i u in the box */
  pc_real* reach = w->z;   /* sum_j |G_ij| max(|lower_j|, |upper_j|) */
  pc_real* middle = w->u;  /* of the box, and half its width */
  pc_real* half = w->r;
  pc_real known = 0; /* largest limit that matters */
  for (int j = 0; j < PC_INPUTS; ++j) {
    w->box_scale[j] = pc_max(pc_abs(problem->lower[j]), pc_abs(problem->upper[j]));
    middle[j] = (problem->lower[j] + problem->upper[j]) / 2;
    half[j] = (problem->upper[j] - problem->lower[j]) / 2;
    w->is_active[j] = false;
    w->is_active[PC_INPUTS + j] = false;
  }
  for (int i = 0; i < PC_INPUTS; ++i) {
    highest[i] = 0;
    reach[i] = 0;
    for (int j = 0; j < PC_INPUTS; ++j) {
      const pc_real entry = problem->rows[i][j];
      highest[i] += entry * middle[j] + pc_abs(entry) * half[j];
      reach[i] += pc_abs(entry) * w->box_scale[j];
    }
    known = pc_max(known, pc_min(pc_abs(problem->limit[i]), reach[i]));
  }
  w->row_count = 0;
  for (int i = 0; i < PC_INPUTS; ++i) {
    const pc_real limit = problem->limit[i];
    const bool no_reach = reach[i] <= PC_NO_REACH * pc_abs(limit);
    if (limit >= highest[i] || (no_reach && limit >= -PC_LIMIT_ROUNDING * known)) continue;
    const pc_real scale = pc_max(pc_abs(limit), reach[i]);
    if (!pc_finite(scale)) return PC_QP_NUMERICAL;
    const int row = w->row_count++;
    for (int j = 0; j < PC_INPUTS; ++j) w->normals[row][j] = problem->rows[i][j] / scale;
    w->offsets[row] = limit / scale;
    w->row_scales[row] = scale;
    w->row_of[row] = i;
  }
  for (int j = 0; j < PC_INPUTS; ++j) {
    if (!(w->box_scale[j] > 0)) w->box_scale[j] = 1;
  }
  return factorize(problem, w) ? PC_QP_SOLVED : PC_QP_NUMERICAL;
}

/* n' u - b. */
static pc_real violation(const pc_qp_problem* problem, const pc_qp_workspace* w,
                         pc_qp_constraint c) {
  if (c.index >= PC_INPUTS) {
    const int row = c.index - PC_INPUTS;
    return pc_dot(w->normals[row], w->u, PC_INPUTS) - w->offsets[row];
  }
  return c.sign > 0 ? w->u[c.index] - problem->upper[c.index]
                    : problem->lower[c.index] - w->u[c.index];
}

/* PC_VIOLATED, or less where the box is far wider than u: of what rounds in a constraint there. */
static pc_real least_counted(const pc_qp_problem* problem, const pc_qp_workspace* w, int index) {
  pc_real size[PC_INPUTS];
  const pc_real curved = pc_qp_curved_size(problem, w->u, size);
  for (int j = 0; j < PC_INPUTS; ++j) {
    size[j] = pc_min(w->box_scale[j], PC_WIDE * curved / size[j]);
  }
  if (index < PC_INPUTS) return PC_VIOLATED * size[index] / w->box_scale[index];
  const pc_real* normal = w->normals[index - PC_INPUTS];
  pc_real sum = PC_WIDE * pc_abs(w->offsets[index - PC_INPUTS]);
  for (int j = 0; j < PC_INPUTS; ++j) sum += pc_abs(normal[j]) * size[j];
  return PC_VIOLATED * pc_min(sum, 1);
}

/* Step 1: the constraint with the largest violation relative to its scale; false if there is none.
 */
static bool choose_violated(const pc_qp_problem* problem, pc_qp_workspace* w) {
  pc_real largest = 0;
  for (int j = 0; j < PC_INPUTS; ++j) {
    if (w->is_active[j]) continue;
    const pc_real above = w->u[j] - problem->upper[j];
    const pc_real below = problem->lower[j] - w->u[j];
    const pc_real scaled = pc_max(above, below) / w->box_scale[j];
    if (scaled > largest && (scaled > PC_VIOLATED || scaled > least_counted(problem, w, j))) {
      largest = scaled;
      w->entering.index = j;
      w->entering.sign = above > below ? 1 : -1;
    }
  }
  for (int i = 0; i < w->row_count; ++i) {
    const int index = PC_INPUTS + i;
    if (w->is_active[index]) continue;
    const pc_real scaled = pc_dot(w->normals[i], w->u, PC_INPUTS) - w->offsets[i];
    if (scaled > largest && (scaled > PC_VIOLATED || scaled > least_counted(problem, w, index))) {
      largest = scaled;
      w->entering.index = index;
      w->entering.sign = 1;
    }
  }
  return largest > 0;
}

/* x <- R^-1 x. */
static void solve_r(const pc_qp_workspace* w, pc_real* x) {
  for (int k = w->active_count - 1; k >= 0; --k) {
    x[k] /= w->R[k][k];
    pc_axpy(-x[k], w->R[k], x, k);
  }
}

/* Step 2a: d = J' n, z = J2 d2, r = R^-1 d1 for the entering normal n. */
static void evaluate_directions(pc_qp_workspace* w) {
  pc_real all = 0;
  w->d2_squared = 0;
  for (int i = 0; i < PC_INPUTS; ++i) w->z[i] = 0;
  for (int k = 0; k < PC_INPUTS; ++k) {
    const int index = w->entering.index;
    const pc_real d = index < PC_INPUTS ? (w->entering.sign > 0 ? w->J[k][index] : -w->J[k][index])
                                        : pc_dot(w->J[k], w->normals[index - PC_INPUTS], PC_INPUTS);
    w->d[k] = d;
    w->r[k] = d;
    all += d * d;
    if (k < w->active_count) continue;
    w->d2_squared += d * d;
    pc_axpy(d, w->J[k], w->z, PC_INPUTS);
  }
  w->dependent =
      w->active_count == PC_INPUTS || !(w->d2_squared > PC_DEPENDENT * PC_DEPENDENT * all);
  solve_r(w, w->r);
}

/* Step 2b: t1 = min of multiplier_k / r_k over r_k > 0, and its k; infinity if there is none. */
static pc_real longest_dual_step(const pc_qp_workspace* w, int* leaving) {
  pc_real least = 0;
  if (w->dependent) { /* there is no t2: a rounding error in r must not pass for a t1 */
    least = 1;
    for (int k = 0; k < w->active_count; ++k) least = pc_max(least, pc_abs(w->r[k]));
    least *= PC_NEGLIGIBLE;
  }
  pc_real length = PC_INFINITY;
  *leaving = -1;
  for (int k = 0; k < w->active_count; ++k) {
    if (w->r[k] > least && w->multiplier[k] < length * w->r[k]) {
      length = pc_max(w->multiplier[k], 0) / w->r[k];
      *leaving = k;
    }
  }
  return length;
}

/* A reflection of the columns of J2 that maps d2 to (delta, 0, ...); it needs J2 d2, which is z. */
static void add_entering(pc_qp_workspace* w) {
  const int q = w->active_count;
  if (q >= PC_INPUTS) return; /* never: then the entering normal is dependent */
  const pc_real norm = pc_sqrt(w->d2_squared);
  const pc_real delta = w->d[q] > 0 ? -norm : norm;
  const pc_real beta = 1 / (delta * (delta - w->d[q]));
  pc_axpy(-delta, w->J[q], w->z, PC_INPUTS);
  w->d[q] -= delta;
  for (int k = q; k < PC_INPUTS; ++k) pc_axpy(-beta * w->d[k], w->z, w->J[k], PC_INPUTS);
  w->d[q] = delta;
  for (int k = 0; k <= q; ++k) w->R[q][k] = w->d[k];
  w->active[q] = w->entering;
  w->multiplier[q] = w->entering_multiplier;
  w->is_active[w->entering.index] = true;
  w->active_count = q + 1;
}

static void rotate(pc_real c, pc_real s, pc_real* a, pc_real* b) {
  const pc_real old = *a;
  *a = c * old + s * *b;
  *b = c * *b - s * old;
}

/* Removes a column of R and makes R triangular again by rotations of its rows and of J's columns.
 */
static void drop(pc_qp_workspace* w, int position) {
  w->is_active[w->active[position].index] = false;
  const int count = --w->active_count;
  for (int k = position; k < count; ++k) {
    w->active[k] = w->active[k + 1];
    w->multiplier[k] = w->multiplier[k + 1];
    for (int i = 0; i <= k + 1; ++i) w->R[k][i] = w->R[k + 1][i];
  }
  for (int k = position; k < count; ++k) {
    const pc_real length = pc_hypot(w->R[k][k], w->R[k][k + 1]);
    const pc_real c = w->R[k][k] / length;
    const pc_real s = w->R[k][k + 1] / length;
    for (int i = k; i < count; ++i) rotate(c, s, &w->R[i][k], &w->R[i][k + 1]);
    for (int i = 0; i < PC_INPUTS; ++i) rotate(c, s, &w->J[k][i], &w->J[k + 1][i]);
  }
}

/* target <- target + factor n. */
static void add_normal(const pc_qp_workspace* w, pc_qp_constraint c, pc_real factor,
                       pc_real* target) {
  if (c.index < PC_INPUTS) {
    target[c.index] += c.sign > 0 ? factor : -factor;
  } else {
    pc_axpy(factor, w->normals[c.index - PC_INPUTS], target, PC_INPUTS);
  }
}

/* Farkas: with y = 1 for the entering row and -r for the active rows, every u in the box has
 * y' (G u - limit) >= margin, and so violates a row by margin / sum y, whatever rounds in y. */
static pc_real least_violation(const pc_qp_problem* problem, const pc_qp_workspace* w) {
  pc_real sum[PC_INPUTS] = {0}; /* G' y */
  pc_real margin = 0;
  pc_real weight = 0;
  for (int k = 0; k <= w->active_count; ++k) {
    const bool last = k == w->active_count;
    const pc_qp_constraint c = last ? w->entering : w->active[k];
    const pc_real y = last ? 1 : -w->r[k];
    if (c.index < PC_INPUTS || !(y > 0)) continue;
    add_normal(w, c, y, sum);
    margin -= y * w->offsets[c.index - PC_INPUTS];
    weight += y;
  }
  for (int j = 0; j < PC_INPUTS; ++j) {
    margin += sum[j] * (sum[j] > 0 ? problem->lower[j] : problem->upper[j]);
  }
  return weight > 0 ? margin / weight : -PC_INFINITY;
}

/* Raises the limits of the rows in conflict, so that they just have a point in common; and by what
 * counts as violated, or rounding may bring the conflict back. */
static void relax(const pc_qp_problem* problem, pc_qp_workspace* w, pc_real gap) {
  for (int k = 0; k <= w->active_count; ++k) {
    const bool last = k == w->active_count;
    const int index = last ? w->entering.index : w->active[k].index;
    if (index < PC_INPUTS || (!last && !(w->r[k] < 0))) continue;
    w->offsets[index - PC_INPUTS] += pc_max(gap, least_counted(problem, w, index));
  }
}

/* One step of iterative refinement of (u, multipliers) for the active set N' u = b:
 *   H du + N dm = e1 = -(H u + g + N m),  N' du = e2 = b - N' u;  with du = J y:
 *   R' y1 = e2,  y2 = (J' e1)_2,  R dm = (J' e1)_1 - y1. */
static void refine(const pc_qp_problem* problem, pc_qp_workspace* w) {
  pc_real* e1 = w->z;
  const int q = w->active_count;
  for (int j = 0; j < PC_INPUTS; ++j) {
    e1[j] = -problem->gradient[j] - pc_dot(problem->hessian[j], w->u, PC_INPUTS);
  }
  for (int k = 0; k < q; ++k) add_normal(w, w->active[k], -w->multiplier[k], e1);
  for (int k = 0; k < PC_INPUTS; ++k) {
    w->d[k] = pc_dot(w->J[k], e1, PC_INPUTS);
    if (k >= q) continue;
    const pc_real e2 = -violation(problem, w, w->active[k]);
    const pc_real y1 = (e2 - pc_dot(w->R[k], w->d, k)) / w->R[k][k];
    w->r[k] = w->d[k] - y1;
    w->d[k] = y1;
  }
  for (int k = 0; k < PC_INPUTS; ++k) pc_axpy(w->d[k], w->J[k], w->u, PC_INPUTS);
  solve_r(w, w->r);
  pc_axpy(1, w->r, w->multiplier, q);
}

/* PC_QP_SOLVED: nothing is violated; optimality is unchecked. */
static pc_qp_status iterate(const pc_qp_problem* problem, pc_qp_workspace* w, int* changes) {
  /* Step 0: the unconstrained minimum u = -J J' g. */
  w->active_count = 0;
  for (int j = 0; j < PC_INPUTS; ++j) w->u[j] = 0;
  for (int k = 0; k < PC_INPUTS; ++k) {
    pc_axpy(-pc_dot(w->J[k], problem->gradient, k + 1), w->J[k], w->u, k + 1);
  }

  bool entering = false;
  for (*changes = 0; *changes < PC_QP_MOST_CHANGES; ++*changes) {
    /* Step 1: choose a violated constraint; if there is none, refine u and look again. */
    if (!entering) {
      if (!choose_violated(problem, w)) {
        refine(problem, w);
        if (!choose_violated(problem, w)) return PC_QP_SOLVED;
      }
      entering = true;
      w->entering_multiplier = 0;
    }
    /* Steps 2a and 2b: directions; t1 keeps the multipliers positive, t2 ends the violation. */
    int leaving = -1;
    evaluate_directions(w);
    const pc_real t1 = longest_dual_step(w, &leaving);
    const pc_real t2 =
        w->dependent ? PC_INFINITY : violation(problem, w, w->entering) / w->d2_squared;
    const pc_real t = pc_min(t1, t2);

    /* Step 2c: no step, a step in dual space, or a step in both. */
    if (t == PC_INFINITY) {
      const pc_real gap = least_violation(problem, w);
      if (gap > PC_FEASIBLE) return PC_QP_INFEASIBLE;
      if (!(gap >= -PC_FEASIBLE) || w->entering_multiplier > 0) return PC_QP_NUMERICAL;
      relax(problem, w, gap);
      refine(problem, w);
      entering = false;
      continue;
    }
    if (!w->dependent) pc_axpy(-t, w->z, w->u, PC_INPUTS);
    pc_axpy(-t, w->r, w->multiplier, w->active_count);
    w->entering_multiplier += t;
    if (t == t2) {
      add_entering(w);
      entering = false;
    } else if (leaving >= 0) {
      drop(w, leaving);
    } else { /* t is NaN */
      return PC_QP_NUMERICAL;
    }
  }
  return PC_QP_CHANGE_LIMIT;
}

/* Writes u and the multipliers, and checks the KKT conditions of what was written. */
static pc_qp_status conclude(const pc_qp_problem* problem, const pc_qp_workspace* w,
                             pc_qp_solution* solution) {
  for (int j = 0; j < PC_INPUTS; ++j) {
    solution->power[j] = pc_clamp(w->u[j], problem->lower[j], problem->upper[j]);
  }
  for (int k = 0; k < w->active_count; ++k) {
    const int index = w->active[k].index;
    const pc_real multiplier = pc_max(w->multiplier[k], 0); /* more than rounding shows below */
    if (index >= PC_INPUTS) {
      const int row = index - PC_INPUTS;
      solution->row_multiplier[w->row_of[row]] = multiplier / w->row_scales[row];
    } else if (w->active[k].sign > 0) {
      solution->power[index] = problem->upper[index];
      solution->bound_multiplier[index] = multiplier;
    } else {
      solution->power[index] = problem->lower[index];
      solution->bound_multiplier[index] = -multiplier;
    }
  }
  return pc_qp_is_optimal(problem, solution) ? PC_QP_SOLVED : PC_QP_KKT_FAILED;
}

pc_qp_status pc_qp_solve(const pc_qp_problem* problem, pc_qp_workspace* workspace,
                         pc_qp_solution* solution) {
  solution->changes = 0;
  for (int j = 0; j < PC_INPUTS; ++j) {
    solution->bound_multiplier[j] = 0;
    solution->row_multiplier[j] = 0;
  }
  pc_qp_status status = pc_qp_examine(problem);
  if (status == PC_QP_SOLVED) status = prepare(problem, workspace);
  if (status == PC_QP_SOLVED) status = iterate(problem, workspace, &solution->changes);
  if (status == PC_QP_SOLVED) status = conclude(problem, workspace, solution);
  if (status != PC_QP_SOLVED) {
    for (int j = 0; j < PC_INPUTS; ++j) {
      const pc_real otherwise = problem->upper[j] < 0 ? problem->upper[j] : 0;
      solution->power[j] = pc_finite(problem->lower[j]) ? problem->lower[j] : otherwise;
      solution->bound_multiplier[j] = 0;
      solution->row_multiplier[j] = 0;
    }
  }
  solution->status = status;
  return status;
}
