/* The data of a problem, and the Karush-Kuhn-Tucker conditions of an answer, see pc_qp.h.
 * Everything is relative to the terms that cancel, so that scaling of rows or objective changes
 * nothing. */
#include "pc_math.h"
#include "pc_qp.h"

#if PC_SINGLE
#define PC_STATIONARY PC_R(1e-4)
#define PC_FEASIBLE PC_R(1e-5)
#define PC_NO_REACH PC_R(1e-6)
#else
#define PC_STATIONARY PC_R(1e-11)
#define PC_FEASIBLE PC_R(1e-9)
#define PC_NO_REACH PC_R(1e-9)
#endif
#define PC_LIMIT_ROUNDING (16 * PC_EPSILON)

/* value <= tolerance * scale, and not where anything is NaN or infinite. */
static bool small(pc_real value, pc_real scale, pc_real tolerance) {
  return value == 0 || (scale < PC_INFINITY && value <= tolerance * scale);
}

/* 0 times what is not finite is NaN. */
pc_qp_status pc_qp_examine(const pc_qp_problem* problem) {
  pc_real zero = 0;
  bool bounded = true;
  bool possible = true;
  for (int i = 0; i < PC_INPUTS; ++i) {
    zero += 0 * problem->gradient[i] + 0 * problem->lower[i] + 0 * problem->upper[i];
    bounded = bounded && problem->limit[i] > -PC_INFINITY;
    possible = possible && problem->lower[i] <= problem->upper[i];
    for (int j = 0; j < PC_INPUTS; ++j) {
      zero += 0 * problem->hessian[i][j] + 0 * problem->rows[i][j];
    }
  }
  if (!bounded || !(zero == 0)) return PC_QP_NUMERICAL;
  return possible ? PC_QP_SOLVED : PC_QP_INFEASIBLE;
}

pc_real pc_qp_curved_size(const pc_qp_problem* problem, const pc_real u[PC_INPUTS],
                          pc_real root[PC_INPUTS]) {
  pc_real size = 0;
  for (int j = 0; j < PC_INPUTS; ++j) {
    root[j] = pc_sqrt(problem->hessian[j][j]);
    size = pc_max(size, pc_abs(u[j]) * root[j]);
    size = pc_max(size, pc_abs(problem->gradient[j]) / root[j]);
  }
  return size;
}

bool pc_qp_is_optimal(const pc_qp_problem* problem, const pc_qp_solution* solution) {
  const pc_real* u = solution->power;
  const pc_real* bound_multiplier = solution->bound_multiplier;
  const pc_real* row_multiplier = solution->row_multiplier;
  pc_real size[PC_INPUTS];  /* how large input j counts: its curvature, not more than the box */
  pc_real box[PC_INPUTS];   /* max(|lower_j|, |upper_j|) */
  pc_real reach[PC_INPUTS]; /* sum_j |G_ij| box_j */
  bool optimal = true;

  const pc_real curved = pc_qp_curved_size(problem, u, size);
  for (int j = 0; j < PC_INPUTS; ++j) {
    box[j] = pc_max(pc_abs(problem->lower[j]), pc_abs(problem->upper[j]));
    size[j] = pc_min(box[j], curved / size[j]);
  }

  /* Stationarity: H u + g + G' l + b = 0. */
  pc_real energy = 0;
  for (int j = 0; j < PC_INPUTS; ++j) {
    pc_real residual = problem->gradient[j] + bound_multiplier[j];
    pc_real terms = pc_abs(problem->gradient[j]) + pc_abs(bound_multiplier[j]);
    for (int i = 0; i < PC_INPUTS; ++i) {
      residual += problem->hessian[j][i] * u[i];
      terms += pc_abs(problem->hessian[j][i]) * size[i];
      residual += problem->rows[i][j] * row_multiplier[i];
      terms += pc_abs(problem->rows[i][j] * row_multiplier[i]);
    }
    optimal = optimal && small(pc_abs(residual), terms, PC_STATIONARY);
    energy += terms * size[j];
  }

  /* The box, and complementarity of its multipliers. */
  for (int j = 0; j < PC_INPUTS; ++j) {
    const pc_real above = u[j] - problem->upper[j];
    const pc_real below = problem->lower[j] - u[j];
    const pc_real slack = bound_multiplier[j] > 0 ? above : below;
    optimal = optimal && small(pc_max(pc_max(above, below), 0), box[j], PC_FEASIBLE) &&
              small(pc_abs(slack * bound_multiplier[j]), energy, PC_FEASIBLE);
  }

  /* The rows, and complementarity of theirs. */
  pc_real known = 0; /* largest limit that matters: how exactly the data are known */
  for (int i = 0; i < PC_INPUTS; ++i) {
    reach[i] = 0;
    for (int j = 0; j < PC_INPUTS; ++j) reach[i] += pc_abs(problem->rows[i][j]) * box[j];
    known = pc_max(known, pc_min(pc_abs(problem->limit[i]), reach[i]));
  }
  for (int i = 0; i < PC_INPUTS; ++i) {
    const pc_real limit = problem->limit[i];
    const pc_real l = row_multiplier[i];
    if (limit == PC_INFINITY) {
      optimal = optimal && l == 0;
      continue;
    }
    pc_real excess = pc_dot(problem->rows[i], u, PC_INPUTS) - limit;
    if (reach[i] <= PC_NO_REACH * pc_abs(limit) && excess <= PC_LIMIT_ROUNDING * known) excess = 0;
    const pc_real scale = pc_max(reach[i], pc_abs(limit));
    /* A row that is exceeded is judged by that alone. */
    const pc_real idle = l < 0 ? -l * scale : pc_max(-excess, 0) * l;
    optimal =
        optimal && small(pc_max(excess, 0), scale, PC_FEASIBLE) && small(idle, energy, PC_FEASIBLE);
  }
  return optimal;
}
