#include "photocoag/qp/active_factor.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "photocoag/core/fixed_length.hpp"
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

// x <- R^-1 x.
template <typename Length>
void ActiveFactor::solve_r(Length inputs, double* __restrict x) const noexcept {
  const int n = inputs;
  for (int k = count_ - 1; k >= 0; --k) {
    x[k] *= inverse_[k];
    const double value = x[k];
    for (int i = 0; i < k; ++i) x[i] -= value * r_[k * n + i];
  }
}

// v <- v - Q Q'v; d1 <- Q'v, or, `again`, that is added to it; v'v afterwards.
template <typename Length>
inline double ActiveFactor::project(Length length, bool again, double* __restrict v) noexcept {
  const int n = n_;
  const int used = length;
  double part[even(kMaxInputs)];
  for (int k = 0; k < count_; ++k) {
    part[k] = dot(q_ + k * n, v, used);
    d1_[k] = again ? d1_[k] + part[k] : part[k];
  }
  for (int k = 0; k < count_; ++k) axpy(-part[k], q_ + k * n, v, used);
  return dot(v, v, used);
}

template <typename Length>
void ActiveFactor::direct_as(Length inputs, const HessianFactor& factor,
                             const Normal& normal) noexcept {
  constexpr bool kKnown = !std::is_same_v<Length, int>;
  constexpr int kCapacity = [] {
    if constexpr (kKnown) {
      return int(Length::value);
    } else {
      return even(kMaxInputs);
    }
  }();
  const int n = inputs;
  double v[kCapacity];
  int length;  // the rest of the normal is 0
  if (normal.row == nullptr) {
    for (int i = 0; i < n; ++i) v[i] = i == normal.index ? normal.scale : 0.0;
    length = normal.index + 1;
  } else {
    for (int i = 0; i < n; ++i) v[i] = normal.scale * normal.row[i * normal.stride];
    length = n;
    while (length > 1 && v[length - 1] == 0.0) --length;
  }
  factor.solve(inputs, v, length);
  direction_length_ = std::max(length, length_);
  // Of a known length, zeros are gone through: the sums are the same to the bit.
  const auto used = [&] {
    if constexpr (kKnown) {
      return inputs;
    } else {
      return direction_length_;
    }
  }();
  const double whole = dot(v, v, used);
  slope_ = whole;
  if (count_ > 0) {
    slope_ = project(used, false, v);
    if (!(slope_ > kCancelled * whole)) slope_ = project(used, true, v);
  }
  if (count_ == n) slope_ = 0.0;  // nothing but rounding is left
  dependent_ = !(slope_ > kDependent * kDependent * whole);
  for (int i = 0; i < n; ++i) v_[i] = v[i];
  for (int k = 0; k < count_; ++k) dual_[k] = d1_[k];
  solve_r(inputs, dual_);
  if (dependent_) return;
  factor.solve_transposed(inputs, v);
  for (int i = 0; i < n; ++i) primal_[i] = v[i];
}

void ActiveFactor::direct(const HessianFactor& factor, const Normal& normal) noexcept {
  for_length<2, 3, 4, 9>(n_, [&](auto inputs) { direct_as(inputs, factor, normal); });
}

void ActiveFactor::add() noexcept {
  const double norm = std::sqrt(slope_);
  const double inverse = 1.0 / norm;
  double* q = q_ + count_ * n_;
  for (int i = 0; i < n_; ++i) q[i] = v_[i] * inverse;
  double* r = r_ + count_ * n_;
  for (int k = 0; k < count_; ++k) r[k] = d1_[k];
  r[count_] = norm;
  inverse_[count_] = inverse;
  length_ = direction_length_;
  ++count_;
}

// R without a column, made triangular again by rotations of its rows and the columns of Q.
void ActiveFactor::drop(int position) noexcept {
  --count_;
  for (int k = position; k < count_; ++k) {
    for (int i = 0; i < k + 2; ++i) r_[k * n_ + i] = r_[(k + 1) * n_ + i];
  }
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
    inverse_[k] = 1.0 / length;
    for (int i = k; i < count_; ++i) rotate(r_[i * n_ + k], r_[i * n_ + k + 1]);
    for (int i = 0; i < length_; ++i) rotate(q_[k * n_ + i], q_[(k + 1) * n_ + i]);
  }
  if (count_ == 0) length_ = 0;
}

void ActiveFactor::correct(const HessianFactor& factor, double* e1, double* e2) const noexcept {
  factor.solve(n_, e1, n_);
  double y1[even(kMaxInputs)];
  double more[even(kMaxInputs)];
  for (int k = 0; k < count_; ++k) {
    y1[k] = (e2[k] - dot(r_ + k * n_, y1, k)) * inverse_[k];
    more[k] = y1[k] - dot(q_ + k * n_, e1, length_);
  }
  for (int k = 0; k < count_; ++k) {
    axpy(more[k], q_ + k * n_, e1, length_);
    e2[k] = -more[k];
  }
  factor.solve_transposed(n_, e1);
  solve_r(n_, e2);
}

}  // namespace photocoag
