/* The C library functions that the controller needs, in the precision of pc_real. */
#ifndef PC_MATH_H
#define PC_MATH_H

#include <math.h>
#include <stdbool.h>

#include "pc_model.h"

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "the controller looks for NaN and infinity: no -ffast-math, -Ofast or -ffinite-math-only"
#endif

/* PC_R(0.5): a constant of type pc_real. */
#if PC_SINGLE
#define PC_R(x) x##F
#define PC_EPSILON PC_R(1.1920929e-07)
#else
#define PC_R(x) x
#define PC_EPSILON PC_R(2.220446049250313e-16)
#endif
#define PC_INFINITY ((pc_real)INFINITY)

static inline pc_real pc_sqrt(pc_real x) {
#if PC_SINGLE
  return sqrtf(x);
#else
  return sqrt(x);
#endif
}

static inline pc_real pc_exp(pc_real x) {
#if PC_SINGLE
  return expf(x);
#else
  return exp(x);
#endif
}

/* e^x - 1 without cancellation. */
static inline pc_real pc_expm1(pc_real x) {
#if PC_SINGLE
  return expm1f(x);
#else
  return expm1(x);
#endif
}

static inline pc_real pc_abs(pc_real x) {
#if PC_SINGLE
  return fabsf(x);
#else
  return fabs(x);
#endif
}

static inline pc_real pc_max(pc_real a, pc_real b) { return a < b ? b : a; }
static inline pc_real pc_min(pc_real a, pc_real b) { return b < a ? b : a; }

static inline pc_real pc_clamp(pc_real x, pc_real low, pc_real high) {
  return x < low ? low : (x > high ? high : x);
}

/* sqrt(a^2 + b^2) without overflow. */
static inline pc_real pc_hypot(pc_real a, pc_real b) {
  const pc_real large = pc_max(pc_abs(a), pc_abs(b));
  const pc_real small = pc_min(pc_abs(a), pc_abs(b));
  if (!(large > 0)) return 0;
  return large * pc_sqrt(1 + (small / large) * (small / large));
}

/* False for NaN and infinity. */
static inline bool pc_finite(pc_real x) { return pc_abs(x) < PC_INFINITY; }

/* sum_i a_i b_i. */
static inline pc_real pc_dot(const pc_real* a, const pc_real* b, int n) {
  pc_real sum = 0;
  for (int i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

/* y <- y + s x. */
static inline void pc_axpy(pc_real s, const pc_real* x, pc_real* y, int n) {
  for (int i = 0; i < n; ++i) y[i] += s * x[i];
}

#endif
