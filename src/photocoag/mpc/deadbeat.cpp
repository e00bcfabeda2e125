#include "photocoag/mpc/deadbeat.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/mpc/impulse_response.hpp"

namespace photocoag {
namespace {

template <typename Length>
bool meet_as(Length length, const PlanData& data, double* u) noexcept {
  const int n = length;
  const double* __restrict h = data.impulse;
  double rest[even(kMaxInputs)];  // reference - f, less what the powers so far do
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) rest[k] = data.reference[k] - data.free[k];
  const double inverse = 1.0 / h[0];
  PHOTOCOAG_UNROLLED
  for (int j = 0; j < n; ++j) {
    const double power = rest[j] * inverse;
    if (!(power >= data.lower && power <= data.upper)) return false;
    u[j] = power;
    PHOTOCOAG_UNROLLED
    for (int k = j + 1; k < n; ++k) rest[k] -= h[k - j] * power;
  }
  return true;
}

template <typename Length>
double residual_as(Length length, const PlanData& data, const double* u) noexcept {
  const int n = length;
  double response[even(kMaxInputs)];
  respond_to(data.impulse, u, n, response);
  double worst = 0.0;
  bool good = true;
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) {
    good &= u[k] >= data.lower && u[k] <= data.upper && data.impulse[k] >= 0.0;
    const double error = std::abs(response[k] + (data.free[k] - data.reference[k]));
    // Neither NaN nor 0 / 0 may pass for a small residual.
    good &= error < kInfinity && response[k] < kInfinity;
    if (error > worst * response[k]) worst = response[k] > 0.0 ? error / response[k] : kInfinity;
  }
  if (data.limit_impulse != data.impulse) {
    respond_to(data.limit_impulse, u, n, response);
  }
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) good &= response[k] <= data.limit[k] - data.limit_free[k];
  return good ? worst : kInfinity;
}

}  // namespace

bool meet_reference(const PlanData& data, double* u) noexcept {
  return for_length<1, 4, 9>(data.stages, [&](auto length) { return meet_as(length, data, u); });
}

double deadbeat_residual(const PlanData& data, const double* u) noexcept {
  return for_length<1, 4, 9>(data.stages,
                             [&](auto length) { return residual_as(length, data, u); });
}

}  // namespace photocoag
