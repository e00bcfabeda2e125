#include "photocoag/qp/active_factor.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/qp/sums.hpp"

namespace photocoag {
namespace {

constexpr double kDependent = 1e-10;  // sine of the angle (in H^-1) to the span of the active set
constexpr double kCancelled = 0.5;    // of v'v by the first projection: rounding counts, once more

}  // namespace

void ActiveFactor::clear(int inputs) noexcept {
  n_ = inputs;
  count_ = 0;
  length_ = 0;
}

// v <- v - Q Q'v, d1 <- d1 + Q'v.
void ActiveFactor::project(double* d) noexcept {
  double part[even(kMaxInputs)];
  for (int k = 0; k < count_; ++k) {
    part[k] = dot(q_ + k * n_, v_, length_);
    d[k] += part[k];
  }
  for (int k = 0; k < count_; ++k) axpy(-part[k], q_ + k * n_, v_, length_);
}

void ActiveFactor::direct(const HessianFactor& factor, const double* normal, int length) noexcept {
  std::copy_n(normal, length, v_);
  std::fill_n(v_ + length, n_ - length, 0.0);
  factor.solve(v_, length);
  const int used = direction_length_ = std::max(length, length_);
  std::fill_n(d1_, count_, 0.0);
  const double whole = dot(v_, v_, used);
  slope_ = whole;
  if (count_ > 0) {
    project(d1_);
    slope_ = dot(v_, v_, used);
    if (!(slope_ > kCancelled * whole)) {
      project(d1_);
      slope_ = dot(v_, v_, used);
    }
  }
  if (count_ == n_) slope_ = 0.0;  // nothing but rounding is left
  dependent_ = !(slope_ > kDependent * kDependent * whole);
  if (!dependent_) {
    std::copy_n(v_, n_, primal_);
    factor.solve_transposed(primal_);
  }
  std::copy_n(d1_, count_, dual_);
  solve_r(dual_);
}

void ActiveFactor::add() noexcept {
  const double norm = std::sqrt(slope_);
  const double inverse = 1.0 / norm;
  double* q = q_ + count_ * n_;
  for (int i = 0; i < n_; ++i) q[i] = v_[i] * inverse;
  double* r = r_ + count_ * n_;
  std::copy_n(d1_, count_, r);
  r[count_] = norm;
  length_ = direction_length_;
  ++count_;
}

// R without a column, made triangular again by rotations of its rows and the columns of Q.
void ActiveFactor::drop(int position) noexcept {
  --count_;
  for (int k = position; k < count_; ++k) std::copy_n(r_ + (k + 1) * n_, k + 2, r_ + k * n_);
  for (int k = position; k < count_; ++k) {
    double* pivot = r_ + k * n_ + k;
    const double length = std::hypot(pivot[0], pivot[1]);
    const double c = pivot[0] / length;
    const double s = pivot[1] / length;
    const auto rotate = [c, s](double& a, double& b) {
      const double old = a;
      a = c * a + s * b;
      b = c * b - s * old;
    };
    for (int i = k; i < count_; ++i) rotate(r_[i * n_ + k], r_[i * n_ + k + 1]);
    for (int i = 0; i < length_; ++i) rotate(q_[k * n_ + i], q_[(k + 1) * n_ + i]);
  }
  if (count_ == 0) length_ = 0;
}

void ActiveFactor::correct(const HessianFactor& factor, double* e1, double* e2) const noexcept {
  factor.solve(e1, n_);
  double y1[even(kMaxInputs)];
  double more[even(kMaxInputs)];
  for (int k = 0; k < count_; ++k) {
    y1[k] = (e2[k] - dot(r_ + k * n_, y1, k)) / r_[k * n_ + k];
    more[k] = y1[k] - dot(q_ + k * n_, e1, length_);
  }
  for (int k = 0; k < count_; ++k) {
    axpy(more[k], q_ + k * n_, e1, length_);
    e2[k] = -more[k];
  }
  factor.solve_transposed(e1);
  solve_r(e2);
}

// x <- R^-1 x.
void ActiveFactor::solve_r(double* x) const noexcept {
  for (int k = count_ - 1; k >= 0; --k) {
    x[k] /= r_[k * n_ + k];
    axpy(-x[k], r_ + k * n_, x, k);
  }
}

}  // namespace photocoag
