#include "photocoag/mpc/penalized_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/mpc/impulse_response.hpp"

namespace photocoag {
namespace {

constexpr int kCapacity = even(kMaxInputs);

// A generator below the first: H / 2 = … + weight L(values) L(values)'.
struct Generator {
  double weight = 0.0;
  double values[kCapacity];
};

// The rotation that brings row k of `other` into the first generator, whose row k is 1:
// Gentleman's, without roots. Row i of the first generator is in first[i - k].
inline void rotate(int k, int n, double& weight, double* __restrict first,
                   Generator& other) noexcept {
  const double b = other.values[k];
  const double sum = weight + other.weight * b * b;
  const double gain = other.weight * b / sum;
  other.weight *= weight / sum;
  weight = sum;
  PHOTOCOAG_UNROLLED
  for (int i = k + 1; i < n; ++i) {
    other.values[i] -= b * first[i - k];
    first[i - k] += gain * other.values[i];
  }
}

// Backwards in time, the last power first, H / 2 is the sum over its generators a of L(a) L(a)',
// L(a) the lower triangular Toeplitz matrix with the first column a: h, sqrt(R1) e_0 and sqrt(R2)
// (e_0 - e_1). Column k of the unit Cholesky factor is the first generator, after rotations have
// brought row k of the others into it; then it shifts down by one, which costs nothing.
template <int Others, typename Length>
bool minimize_as(Length length, const PlanData& data, const PlanPenalties& penalties,
                 double* __restrict u) noexcept {
  const int n = length;
  double error[kCapacity];  // reference - f, backwards
  double right[kCapacity];  // - g / 2, backwards
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) error[k] = data.reference[n - 1 - k] - data.free[n - 1 - k];
  respond_to(data.impulse, error, n, right);
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) right[k] += penalties.power * penalties.power_reference;
  right[n - 1] += penalties.change * penalties.previous;

  double weight = data.impulse[0] * data.impulse[0];
  double first[kCapacity];
  const double scale = 1.0 / data.impulse[0];
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) first[k] = data.impulse[k] * scale;
  Generator others[Others];
  for (Generator& other : others) {
    PHOTOCOAG_UNROLLED
    for (int k = 0; k < n; ++k) other.values[k] = 0.0;
    other.values[0] = 1.0;
  }
  others[0].weight = penalties.power;
  if (Others == 2 || penalties.power == 0.0) {
    Generator& change = others[Others - 1];
    change.weight = penalties.change;
    if (n > 1) change.values[1] = -1.0;
  }

  double factor[kCapacity * kCapacity];  // columns, n apart
  double inverse[kCapacity];             // of the pivots
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) {
    for (Generator& other : others) rotate(k, n, weight, first, other);
    if (!(weight > 0.0)) return false;
    inverse[k] = 1.0 / weight;
    double* __restrict column = factor + k * n;
    PHOTOCOAG_UNROLLED
    for (int i = k + 1; i < n; ++i) {
      column[i] = first[i - k];
      right[i] -= first[i - k] * right[k];
    }
  }
  bool inside = true;
  PHOTOCOAG_UNROLLED
  for (int k = n - 1; k >= 0; --k) {
    const double* column = factor + k * n;
    double even = 0.0;
    double odd = 0.0;
    int i = k + 1;
    PHOTOCOAG_UNROLLED
    for (; i + 1 < n; i += 2) {
      even += column[i] * right[i];
      odd += column[i + 1] * right[i + 1];
    }
    if (i < n) even += column[i] * right[i];
    right[k] = right[k] * inverse[k] - (even + odd);
    inside &= right[k] >= data.lower && right[k] <= data.upper;
    u[n - 1 - k] = right[k];
  }
  return inside;
}

template <typename Length>
double penalized_residual_as(Length length, const PlanData& data, const PlanPenalties& penalties,
                             const double* __restrict u) noexcept {
  const int n = length;
  double response[kCapacity];
  double backwards[kCapacity];
  double of_powers[kCapacity];  // G'G u, backwards
  double of_errors[kCapacity];  // G'(f - reference), backwards
  respond_to(data.impulse, u, n, response);
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) backwards[k] = response[n - 1 - k];
  respond_to(data.impulse, backwards, n, of_powers);
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) backwards[k] = data.free[n - 1 - k] - data.reference[n - 1 - k];
  respond_to(data.impulse, backwards, n, of_errors);
  double worst = 0.0;
  bool good = true;
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) {
    // Half of H u and of g.
    const double after = k + 1 < n ? u[k] - u[k + 1] : 0.0;
    const double before = k > 0 ? u[k] - u[k - 1] : u[k];
    const double steep =
        of_powers[n - 1 - k] + penalties.power * u[k] + penalties.change * (before + after);
    const double gradient = of_errors[n - 1 - k] - penalties.power * penalties.power_reference -
                            (k == 0 ? penalties.change * penalties.previous : 0.0);
    const double error = std::abs(steep + gradient);
    const double terms = std::abs(steep) + std::abs(gradient);
    good &= u[k] >= data.lower && u[k] <= data.upper && terms < kInfinity;
    if (error > worst * terms) worst = error / terms;
  }
  if (data.limit_impulse != data.impulse) respond_to(data.limit_impulse, u, n, response);
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) {
    good &= response[k] > -kInfinity && response[k] <= data.limit[k] - data.limit_free[k];
  }
  return good ? worst : kInfinity;
}

}  // namespace

bool minimize_penalized(const PlanData& data, const PlanPenalties& penalties, double* u) noexcept {
  return for_length<1, 4, 9>(data.stages, [&](auto length) {
    return penalties.power > 0.0 && penalties.change > 0.0
               ? minimize_as<2>(length, data, penalties, u)
               : minimize_as<1>(length, data, penalties, u);
  });
}

double penalized_residual(const PlanData& data, const PlanPenalties& penalties,
                          const double* u) noexcept {
  return for_length<1, 4, 9>(
      data.stages, [&](auto length) { return penalized_residual_as(length, data, penalties, u); });
}

}  // namespace photocoag
