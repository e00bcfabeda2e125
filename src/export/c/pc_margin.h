/* Back-off from the peak limit, (E28) or (U3). */
#ifndef PC_MARGIN_H
#define PC_MARGIN_H

#include "pc_controller.h"

#if PC_CERTIFIED
typedef struct {
  pc_real input[PC_ORDER];    /* B_d at the largest plausible alpha */
  pc_real free[PC_INPUTS];    /* K, at stages 1 ... N-1 whatever the powers */
  pc_real impulse[PC_INPUTS]; /* K for u_max, i + 1 periods after the power */
} pc_margin;

/* Terms of the rows beyond the estimated peak: deviations of state and alpha, and the model's error
 * bound for the powers applied so far and those to come. */
void pc_margin_evaluate(const pc_controller* c, pc_margin* margin);

/* Advances by one period with `power`, W. */
void pc_margin_observe(pc_controller* c, pc_real power);
#endif

#if PC_CHANCE
/* The deviation of a peak depends weakly on the powers that lead to it: the problem is solved with
 * the margin at the previous plan, then at the plan found, until the limit changes by less. */
#define PC_MOST_SOLVES 4
#define PC_SAME_LIMIT PC_R(1e-3) /* K */

/* Starts from the previous plan, shifted. */
void pc_margin_begin(pc_controller* c);

/* (U3) at the powers `around`; returns the largest change of a stage's margin, K. */
pc_real pc_margin_evaluate(pc_controller* c);
#endif

#endif
