/* A photocoag controller in C99: estimate, reference power, condensing, quadratic program, gate.
 * Algorithm 1 of M. Schaller et al., "Model predictive control for retinal laser treatment at
 * 1 kHz"; (E14) to (E23) and (E28) are those of docs/equations.md of photocoag,
 * (U1) to (U3) those of docs/uncertainty.md.
 *
 * RESEARCH SOFTWARE, NOT A MEDICAL DEVICE. THE SUPERVISOR IS NOT IN IT: no watchdog, no second
 * model beside the estimate, no limit on energy or exposure, no check of the laser's readback.
 *
 *   static pc_controller controller;               caller-owned, no globals, no heap
 *   pc_controller_init(&controller);
 *   power = pc_controller_start(&controller);      W, for the first period
 *   for every period:
 *     power = pc_controller_step(&controller, volume temperature, applied power);
 *
 * Units: K (rise over ambient), W (commanded power). Bounded loops, no recursion, no stdio.
 * One object per eye; two objects share nothing but constants. */
#ifndef PC_CONTROLLER_H
#define PC_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "pc_filter.h"
#include "pc_model.h"
#include "pc_qp.h"

typedef enum {
  PC_SOLVED,     /* the first power of the minimizer */
  PC_RELAXED,    /* the same with a relaxed limit, which even the smallest powers exceed, (E22) */
  PC_FAILED,     /* the solver gave no answer: 0 W */
  PC_KKT_FAILED, /* its answer does not satisfy the KKT conditions: 0 W */
  PC_BAD_INPUT   /* sample or applied power was not finite: 0 W */
} pc_status;

typedef enum {
  PC_PASSED,
  PC_NOT_FINITE, /* NaN or infinite: 0 W */
  PC_OUTSIDE     /* below 0 or above the largest power by more than rounding: 0 W */
} pc_gate;

/* The last decision and its inputs. */
typedef struct {
  pc_real power;           /* W, passed by the gate */
  pc_real power_reference; /* W, u_ref, (E21) */
  pc_status status;
  pc_gate gate;
  pc_sample_use sample;
  int changes;       /* of the active set */
  bool limit_active; /* the peak limit is active at some stage of the plan */
} pc_decision;

/* State of a controller. Only the first two members are meant for reading. */
typedef struct {
  pc_filter filter;     /* the estimate */
  pc_decision decision; /* the last one */

  pc_real previous_power; /* W, applied in the last period */
  pc_real pending_power;  /* W, decided last */
  int32_t cycle;          /* periods since the start */
  int stage;              /* of the current plan */
  bool started;
#if PC_CERTIFIED
  pc_real applied[PC_MAJORANT_TERMS]; /* W, b_j of the powers applied so far, (E28) */
#endif
#if PC_CHANCE
  pc_real ahead[PC_ORDER];   /* J, modes when the new power begins to act */
  pc_real around[PC_INPUTS]; /* W, powers at which the margin is evaluated */
  pc_real margin[PC_INPUTS]; /* K, back-off from the limit, (U3) */
  pc_real relative_sigma;    /* of the next peak */
#endif
#if PC_IDENTIFICATION > 0
  bool known; /* the identification phase is over */
#endif
  pc_qp_problem problem;
  pc_qp_workspace workspace;
  pc_qp_solution plan;
  pc_real before;                 /* W, u_prev */
  pc_real state[PC_ORDER];        /* when the new power begins to act */
  pc_real free[PC_INPUTS];        /* K, f_1 ... f_(N-1), (E19) */
  pc_real impulse[PC_INPUTS];     /* h_i u_max, (E19) */
  pc_real row_impulse[PC_INPUTS]; /* the same in the limit's rows, (E28) */
} pc_controller;

/* Tissue at ambient, the initial absorption factor, cycle 0. */
void pc_controller_init(pc_controller* controller);

/* The power of the first period, W. */
pc_real pc_controller_start(pc_controller* controller);

/* The power of the coming period, W, from the volume temperature at the end of the last period, K,
 * and the power that the laser emitted during it, W (the command if it is not measured). An input
 * that is NaN or infinite gives 0 W, and the period counts as one without a sample. */
pc_real pc_controller_step(pc_controller* controller, pc_real volume_temperature,
                           pc_real applied_power);

/* The same without a sample: continues with the prediction. */
pc_real pc_controller_step_without_sample(pc_controller* controller, pc_real applied_power);

/* Estimated peak temperature, K, and its standard deviation. */
pc_real pc_controller_peak(const pc_controller* controller);
pc_real pc_controller_peak_sigma(const pc_controller* controller);

#endif
