/* What is kept away from the peak limit, (E28) or (U3). */
#ifndef PC_MARGIN_H
#define PC_MARGIN_H

#include "pc_controller.h"

#if PC_CERTIFIED
typedef struct {
  pc_real input[PC_ORDER];    /* B_d at the largest plausible alpha */
  pc_real free[PC_INPUTS];    /* K, at stages 1 ... N-1 whatever the powers */
  pc_real impulse[PC_INPUTS]; /* K for u_max, i + 1 periods after the power */
} pc_margin;

/* What the rows have more than the estimate's peak: deviations of state and alpha, and the model's
 * running error bound of the powers applied so far and of those to come. */
void pc_margin_evaluate(const pc_controller* c, pc_margin* margin);

/* One period has passed with `power`, W. */
void pc_margin_observe(pc_controller* c, pc_real power);
#endif

#if PC_CHANCE
/* How uncertain a peak is depends a little on the powers that lead to it: solved around the plan of
 * before, then around the plan found, until the limit stays within so much, K. */
#define PC_MOST_SOLVES 4
#define PC_SAME_LIMIT PC_R(1e-3)

/* Begins with the plan of before, shifted. */
void pc_margin_begin(pc_controller* c);

/* (U3) around the powers `around`; returns the most by which the margin of a stage changed, K. */
pc_real pc_margin_evaluate(pc_controller* c);
#endif

#endif
