/* The exported controller behind plain doubles, so that one test program can hold many of them. */
#include <stddef.h>

#include "pc_controller.h"

size_t shim_size(void) { return sizeof(pc_controller); }
int shim_inputs(void) { return PC_INPUTS; }
void shim_init(void* c) { pc_controller_init(c); }
double shim_start(void* c) { return (double)pc_controller_start(c); }
double shim_step(void* c, double sample, double power) {
  return (double)pc_controller_step(c, (pc_real)sample, (pc_real)power);
}
double shim_step_without_sample(void* c, double power) {
  return (double)pc_controller_step_without_sample(c, (pc_real)power);
}
double shim_peak(const void* c) { return (double)pc_controller_peak(c); }
double shim_peak_sigma(const void* c) { return (double)pc_controller_peak_sigma(c); }
double shim_reference(const void* c) {
  return (double)((const pc_controller*)c)->decision.power_reference;
}
int shim_status(const void* c) { return (int)((const pc_controller*)c)->decision.status; }
int shim_changes(const void* c) { return ((const pc_controller*)c)->decision.changes; }
int shim_use(const void* c) { return (int)((const pc_controller*)c)->decision.sample; }

/* H and G column by column, as Eigen has them. */
int shim_qp(const double* H, const double* g, const double* lower, const double* upper,
            const double* G, const double* limit, double* power, double* bound_multiplier,
            double* row_multiplier) {
  static pc_qp_problem problem;
  static pc_qp_workspace workspace;
  static pc_qp_solution solution;
  for (int i = 0; i < PC_INPUTS; ++i) {
    problem.gradient[i] = (pc_real)g[i];
    problem.lower[i] = (pc_real)lower[i];
    problem.upper[i] = (pc_real)upper[i];
    problem.limit[i] = (pc_real)limit[i];
    for (int j = 0; j < PC_INPUTS; ++j) {
      problem.hessian[i][j] = (pc_real)H[i + j * PC_INPUTS];
      problem.rows[i][j] = (pc_real)G[i + j * PC_INPUTS];
    }
  }
  const pc_qp_status status = pc_qp_solve(&problem, &workspace, &solution);
  for (int i = 0; i < PC_INPUTS; ++i) {
    power[i] = (double)solution.power[i];
    bound_multiplier[i] = (double)solution.bound_multiplier[i];
    row_multiplier[i] = (double)solution.row_multiplier[i];
  }
  return (int)status;
}
