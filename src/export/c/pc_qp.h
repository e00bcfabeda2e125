/* The quadratic program of one cycle, (E20) of docs/equations.md of photocoag, its exact solver and
 * the check of every answer.
 *
 *   min over u of 1/2 u' H u + g' u   subject to   lower <= u <= upper,  G u <= limit
 *
 * Source: D. Goldfarb, A. Idnani, "A numerically stable dual method for solving strictly convex
 * quadratic programs", Math. Programming 27 (1983) 1-33, as in photocoag's solver `dense`.
 * At most PC_QP_MOST_CHANGES changes of the active set of O(n^2) operations each, after O(n^3) of
 * preparation. No heap, no globals, no state between solves. */
#ifndef PC_QP_H
#define PC_QP_H

#include <stdbool.h>

#include "pc_model.h"

#define PC_INPUTS (PC_HORIZON - 1)
#define PC_QP_MOST_CHANGES (16 * PC_INPUTS + 16)

typedef struct {
  pc_real hessian[PC_INPUTS][PC_INPUTS]; /* H, symmetric positive definite, both triangles */
  pc_real gradient[PC_INPUTS];           /* g */
  pc_real lower[PC_INPUTS];
  pc_real upper[PC_INPUTS];
  pc_real rows[PC_INPUTS][PC_INPUTS]; /* G */
  pc_real limit[PC_INPUTS];           /* +infinity: no constraint */
} pc_qp_problem;

typedef enum {
  PC_QP_SOLVED,       /* u is the minimizer, checked against the KKT conditions */
  PC_QP_INFEASIBLE,   /* no u satisfies the constraints; u = lower */
  PC_QP_CHANGE_LIMIT, /* PC_QP_MOST_CHANGES was reached; u = lower */
  PC_QP_NUMERICAL,    /* data not finite, or H not positive definite; u = lower if finite */
  PC_QP_KKT_FAILED    /* an answer that does not satisfy the KKT conditions; u = lower */
} pc_qp_status;

/* H u + g + G' row_multiplier + bound_multiplier = 0. Unless solved, multipliers are 0. */
typedef struct {
  pc_real power[PC_INPUTS];            /* u, inside [lower, upper] at every status */
  pc_real bound_multiplier[PC_INPUTS]; /* > 0: upper bound active, < 0: lower bound active */
  pc_real row_multiplier[PC_INPUTS];   /* >= 0 */
  pc_qp_status status;
  int changes; /* of the active set */
} pc_qp_solution;

/* n' u <= b. index < PC_INPUTS: bound of input `index`, n = sign e_index; else a row. */
typedef struct {
  int index;
  int sign;
} pc_qp_constraint;

/* Work space of one solve; needs no initialization. */
typedef struct {
  /* The constraints, normalized: rows that some u in the box violates, over their scale. */
  int row_count;
  int row_of[PC_INPUTS]; /* the row of the problem */
  pc_real box_scale[PC_INPUTS];
  pc_real normals[PC_INPUTS][PC_INPUTS];
  pc_real offsets[PC_INPUTS];
  pc_real row_scales[PC_INPUTS];
  /* The iterate, its active set and the constraint that enters. */
  pc_real u[PC_INPUTS];
  int active_count;
  pc_qp_constraint active[PC_INPUTS];
  pc_real multiplier[PC_INPUTS];
  bool is_active[2 * PC_INPUTS];
  pc_qp_constraint entering;
  pc_real entering_multiplier;
  /* Factors J' H J = I and J' N = (R; 0), N the normals of the active set; column by column. */
  pc_real J[PC_INPUTS][PC_INPUTS];
  pc_real R[PC_INPUTS][PC_INPUTS];
  /* For the entering normal n: d = J' n, z = J2 d2, r = R^-1 d1. */
  pc_real d[PC_INPUTS];
  pc_real z[PC_INPUTS];
  pc_real r[PC_INPUTS];
  pc_real d2_squared;
  bool dependent; /* n lies in the span of the active normals */
} pc_qp_workspace;

pc_qp_status pc_qp_solve(const pc_qp_problem* problem, pc_qp_workspace* workspace,
                         pc_qp_solution* solution);

/* PC_QP_SOLVED if the data are valid: all finite, except that a limit may be +infinity;
 * PC_QP_INFEASIBLE if some lower > upper; else PC_QP_NUMERICAL. */
pc_qp_status pc_qp_examine(const pc_qp_problem* problem);

/* True if a solution, of any solver, satisfies the KKT conditions: stationarity, feasibility and
 * complementarity, each relative to the terms that cancel in it. */
bool pc_qp_is_optimal(const pc_qp_problem* problem, const pc_qp_solution* solution);

/* Size of u independent of the box: max_j of |u_j| sqrt(H_jj) and |g_j| / sqrt(H_jj). Writes
 * sqrt(H_jj) into `root`. */
pc_real pc_qp_curved_size(const pc_qp_problem* problem, const pc_real u[PC_INPUTS],
                          pc_real root[PC_INPUTS]);

#endif
