/* Instructions of the quadratic program alone, ours and OSQP's generated code on the same problems:
 * a closed loop of the exported controller (N = 5) on eyes that differ, with noise that keeps the
 * estimate at the limit. SysTick as in tests/export/cortex_m/count.c. */
#include <stdint.h>

#include "osqp.h"
#include "pc_controller.h"
#include "workspace.h"

#define TICK 40
#define TICKS (*(volatile uint32_t*)0xE000E018)
#define PERIODS 1000
#define N PC_INPUTS

void print_number(const char* name, uint32_t value);

typedef struct {
  uint64_t sum;
  uint32_t worst;
} counter;

static void count(counter* c, uint32_t before) {
  const uint32_t ticks = (before - TICKS) & 0xFFFFFF;
  c->sum += ticks;
  if (ticks > c->worst) c->worst = ticks;
}

static uint32_t seed = 12345;

/* Close to normal: the sum of twelve uniform numbers. */
static float normal(void) {
  float sum = -6;
  for (int i = 0; i < 12; ++i) {
    seed = seed * 1664525U + 1013904223U;
    sum += (float)(seed >> 8) / 16777216.0F;
  }
  return sum;
}

static float dot(const float* a, const float* b) {
  float sum = 0;
  for (int i = 0; i < PC_ORDER; ++i) sum += a[i] * b[i];
  return sum;
}

static pc_controller controller;

static void period(int n) {
  static float eye[PC_ORDER], power;
  static pc_matrices matrices;
  if (n % 250 == 0) {
    pc_controller_init(&controller);
    for (int i = 0; i < PC_ORDER; ++i) eye[i] = 0;
    pc_evaluate(0.5F + 0.3F * (float)(n / 250), &matrices);
    power = pc_controller_start(&controller);
    return;
  }
  pc_propagate(eye);
  for (int i = 0; i < PC_ORDER; ++i) eye[i] += matrices.input[i] * power;
  power = pc_controller_step(&controller, dot(matrices.volume, eye) + 0.4F * normal(), power);
}

static void solve_by_osqp(const pc_qp_problem* problem) {
  OSQPFloat P[N * (N + 1) / 2], A[N + N * (N + 1) / 2], q[N], lower[2 * N], upper[2 * N];
  int p = 0;
  int a = 0;
  for (int j = 0; j < N; ++j) {
    for (int i = 0; i <= j; ++i) P[p++] = problem->hessian[i][j];
    A[a++] = 1;
    for (int i = j; i < N; ++i) A[a++] = problem->rows[i][j];
    q[j] = problem->gradient[j];
    lower[j] = problem->lower[j];
    upper[j] = problem->upper[j];
    lower[N + j] = -1e20F;
    upper[N + j] = problem->limit[j];
  }
  osqp_update_data_mat(&solver, P, 0, p, A, 0, a);
  osqp_update_data_vec(&solver, q, lower, upper);
  osqp_solve(&solver);
}

int main(void) {
  static pc_qp_workspace workspace;
  static pc_qp_solution solution;
  counter ours = {0, 0};
  counter theirs = {0, 0};
  uint32_t unsolved = 0;
  float difference = 0;
  *(volatile uint32_t*)0xE000E014 = 0xFFFFFF;
  *(volatile uint32_t*)0xE000E010 = 5;
  for (int n = 0; n < PERIODS; ++n) {
    period(n);
    uint32_t before = TICKS;
    pc_qp_solve(&controller.problem, &workspace, &solution);
    count(&ours, before);
    before = TICKS;
    solve_by_osqp(&controller.problem);
    count(&theirs, before);
    if (solver.info->status_val != OSQP_SOLVED) ++unsolved;
    const float off = solver.solution->x[0] - solution.power[0];
    if (off > difference) difference = off;
    if (-off > difference) difference = -off;
  }
  print_number("ours, mean", (uint32_t)(ours.sum * TICK / PERIODS));
  print_number("ours, worst", ours.worst * TICK);
  print_number("OSQP, mean", (uint32_t)(theirs.sum * TICK / PERIODS));
  print_number("OSQP, worst", theirs.worst * TICK);
  print_number("OSQP, not solved, per mille", unsolved);
  print_number("first powers differ by at most, uW", (uint32_t)(1e6F * PC_POWER_MAX * difference));
  return 0;
}
