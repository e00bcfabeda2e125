// Role: online; functions shared by the estimators of (x, alpha[, beta]): derivatives by the
// unknowns, covariance steps, the box of the unknowns. Used by ekf, mhe, posterior. Source:
// docs/equations.md (E15) to (E17). Real time: noexcept, bounded, no allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// For more unknowns see PosteriorEstimator (rom/uncertain_model.hpp).
inline constexpr int kMaxUnknowns = 2;
inline constexpr int kMaxExtended = kMaxOrder + kMaxUnknowns;

using ExtendedVector = BoundedVector<kMaxExtended>;
using ExtendedMatrix = BoundedMatrix<kMaxExtended, kMaxExtended>;
using SlopeMatrix = BoundedMatrix<kMaxOrder, kMaxUnknowns>;
/// alpha, beta; beta is a constant with one unknown.
using Parameters = std::array<double, kMaxUnknowns>;

struct ParameterBox {
  Parameters low{};
  Parameters high{};
};

inline ParameterBox parameter_box(const EstimatorSettings& s) noexcept {
  return {{s.absorption_min, s.choroid_min}, {s.absorption_max, s.choroid_max}};
}

inline Parameters drift_variance(const EstimatorSettings& s) noexcept {
  return {s.absorption_process_noise * s.absorption_process_noise,
          s.choroid_process_noise * s.choroid_process_noise};
}

inline void evaluate_at(const ReducedModel& model, const Parameters& p,
                        ParametricMatrices& out) noexcept {
  if (model.parameters.size() == 1) {
    model.evaluate(p[0], out);
  } else {
    model.evaluate({p[0], p[1]}, out);
  }
}

/// The diagonal of an exactly diagonal matrix, else empty.
inline StateVector diagonal_alone(const StateMatrix& A) noexcept {
  StateVector diagonal = A.diagonal();
  for (int j = 0; j < A.cols(); ++j) {
    for (int i = 0; i < A.rows(); ++i) {
      if (i != j && A(i, j) != 0.0) diagonal.resize(0);  // NaN too
      if (diagonal.size() == 0) return diagonal;
    }
  }
  return diagonal;
}

/// A x. `decay`: diagonal_alone(A); products with zeros are skipped.
inline StateVector next_free_state(const StateMatrix& A, const StateVector& decay,
                                   const StateVector& x) noexcept {
  if (decay.size() == 0) return A.lazyProduct(x);
  return decay.cwiseProduct(x);
}

/// predict_covariance() for one fixed order.
template <int U, typename Order>
void predict_covariance_of(Order order, const StateMatrix& A, const StateVector& decay,
                           const StateVector& input, const SlopeMatrix& b, double power_variance,
                           const Parameters& drift, ExtendedMatrix& P) noexcept {
  const int n = order;
  const int stride = n + U;
  double* p = P.data();
  StateMatrix full;  // A P A'
  double cross[U][kMaxOrder];
  double input_part[kMaxOrder];
  double slope_part[U][U][kMaxOrder];
  const double* slope[U];
  for (int q = 0; q < U; ++q) slope[q] = b.data() + q * n;
  if (decay.size() == 0) {
    const StateMatrix half = A.lazyProduct(P.topLeftCorner(n, n));
    full = half.lazyProduct(A.transpose());
    for (int q = 0; q < U; ++q) {
      const StateVector column = A.lazyProduct(P.col(n + q).head(n));
      std::copy_n(column.data(), n, cross[q]);
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i <= j; ++i) p[j * stride + i] = 0.5 * (full(i, j) + full(j, i));
    }
  } else {
    const double* lambda = decay.data();
    PHOTOCOAG_UNROLLED
    for (int q = 0; q < U; ++q) {
      PHOTOCOAG_UNROLLED
      for (int i = 0; i < n; ++i) cross[q][i] = lambda[i] * p[(n + q) * stride + i];
    }
    // Both orders of multiplication, as in the full product.
    PHOTOCOAG_UNROLLED
    for (int j = 0; j < n; ++j) {
      double* column = p + j * stride;
      const double l = lambda[j];
      PHOTOCOAG_UNROLLED
      for (int i = 0; i <= j; ++i) {
        column[i] = 0.5 * (lambda[i] * column[i] * l + l * column[i] * lambda[i]);
      }
    }
  }
  PHOTOCOAG_UNROLLED
  for (int i = 0; i < n; ++i) {
    input_part[i] = power_variance * input[i];
    PHOTOCOAG_UNROLLED
    for (int q = 0; q < U; ++q) {
      PHOTOCOAG_UNROLLED
      for (int r = 0; r < U; ++r) {
        slope_part[q][r][i] = p[(n + r) * stride + n + q] * slope[q][i];
      }
    }
  }
  PHOTOCOAG_UNROLLED
  for (int j = 0; j < n; ++j) {
    double* column = p + j * stride;
    PHOTOCOAG_UNROLLED
    for (int i = 0; i <= j; ++i) {
      double value = column[i];
      PHOTOCOAG_UNROLLED
      for (int q = 0; q < U; ++q) {
        value = value + cross[q][i] * slope[q][j] + slope[q][i] * cross[q][j];
      }
      PHOTOCOAG_UNROLLED
      for (int q = 0; q < U; ++q) {
        PHOTOCOAG_UNROLLED
        for (int r = 0; r < U; ++r) value += slope_part[q][r][i] * slope[r][j];
      }
      column[i] = value + input_part[i] * input[j];
    }
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < j; ++i) p[i * stride + j] = column[i];
  }
  PHOTOCOAG_UNROLLED
  for (int q = 0; q < U; ++q) {
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < n; ++i) {
      double value = cross[q][i];
      PHOTOCOAG_UNROLLED
      for (int r = 0; r < U; ++r) value += slope[r][i] * p[(n + q) * stride + n + r];
      cross[q][i] = value;
    }
  }
  PHOTOCOAG_UNROLLED
  for (int q = 0; q < U; ++q) {
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < n; ++i) p[(n + q) * stride + i] = p[i * stride + n + q] = cross[q][i];
    p[(n + q) * stride + n + q] += drift[q];
  }
}

/// P <- F P F' + diag(s_u^2 B B', drift), F = [A, b; 0, 1], b: columns B'_q u. U = unknowns. P is
/// exactly symmetric and stays so. `decay`: diagonal_alone(A).
template <int U>
void predict_covariance(const StateMatrix& A, const StateVector& decay, const StateVector& input,
                        const SlopeMatrix& b, double power_variance, const Parameters& drift,
                        ExtendedMatrix& P) noexcept {
  for_length<6, 14>(static_cast<int>(input.size()), [&](auto order) {
    predict_covariance_of<U>(order, A, decay, input, b, power_variance, drift, P);
  });
}

/// H = [C, C'_q x].
template <int U>
ExtendedVector measurement_row(const ParametricMatrices& m, const StateVector& x) noexcept {
  const Eigen::Index n = x.size();
  ExtendedVector h(n + U);
  h.head(n) = m.volume;
  for (int q = 0; q < U; ++q) h[n + q] = m.volume_slope[q].dot(x);
  return h;
}

/// P H'.
inline ExtendedVector product(const ExtendedMatrix& P, const ExtendedVector& h) noexcept {
  ExtendedVector out(h.size());
  for_length<7, 8, 15>(static_cast<int>(h.size()), [&](auto length) {
    const int size = length;
    double sum[kMaxExtended];
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < size; ++i) sum[i] = 0.0;
    PHOTOCOAG_UNROLLED
    for (int j = 0; j < size; ++j) {
      const double* column = P.data() + j * size;
      PHOTOCOAG_UNROLLED
      for (int i = 0; i < size; ++i) sum[i] += column[i] * h.data()[j];
    }
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < size; ++i) out.data()[i] = sum[i];
  });
  return out;
}

/// update_covariance() for one fixed size of (x, p).
template <typename Size>
void update_covariance_of(Size length, const ExtendedVector& h, const ExtendedVector& ph,
                          const ExtendedVector& gain, double noise, ExtendedMatrix& P) noexcept {
  const int size = length;
  double* p = P.data();
  const double* k = gain.data();
  double left_h[kMaxExtended];  // T H'
  double noise_gain[kMaxExtended];
  PHOTOCOAG_UNROLLED
  for (int i = 0; i < size; ++i) left_h[i] = 0.0;
  PHOTOCOAG_UNROLLED
  for (int j = 0; j < size; ++j) {
    const double* column = p + j * size;
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < size; ++i) left_h[i] += (column[i] - k[i] * ph.data()[j]) * h.data()[j];
  }
  PHOTOCOAG_UNROLLED
  for (int i = 0; i < size; ++i) noise_gain[i] = noise * k[i];
  PHOTOCOAG_UNROLLED
  for (int j = 0; j < size; ++j) {
    double* column = p + j * size;
    PHOTOCOAG_UNROLLED
    for (int i = 0; i <= j; ++i) {
      const double upper = column[i] - k[i] * ph.data()[j] - left_h[i] * k[j];
      const double lower = column[i] - k[j] * ph.data()[i] - left_h[j] * k[i];
      column[i] = 0.5 * (upper + lower) + noise_gain[i] * k[j];
    }
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < j; ++i) p[i * size + j] = column[i];
  }
}

/// P <- (I - K H) P (I - K H)' + K noise K' as two rank-one steps: T = (I - K H) P, then
/// P = T (I - K H)' + K noise K'. `ph` = P H'. P is exactly symmetric and stays so.
inline void update_covariance(const ExtendedVector& h, const ExtendedVector& ph,
                              const ExtendedVector& gain, double noise,
                              ExtendedMatrix& P) noexcept {
  for_length<7, 8, 15>(static_cast<int>(h.size()),
                       [&](auto length) { update_covariance_of(length, h, ph, gain, noise, P); });
}

/// Standard deviation of C_peak x, K.
inline double extended_peak_sigma(const StateVector& C_peak, const ExtendedMatrix& P) noexcept {
  double variance = 0.0;
  for (int j = 0; j < C_peak.size(); ++j) {
    for (int i = 0; i < C_peak.size(); ++i) variance += C_peak[i] * P(i, j) * C_peak[j];
  }
  return std::sqrt(std::max(0.0, variance));
}

/// The most likely parameters inside the box: min (p - mean)' V^-1 (p - mean), and the multipliers
/// V^-1 (p - mean) along which everything correlated with them moves. V: covariance of the
/// parameters.
struct BoxedParameters {
  Parameters value{};
  Parameters multiplier{};
  bool moved = false;
};

inline BoxedParameters keep_inside(const Parameters& mean, const double (&V)[2][2], int unknowns,
                                   const ParameterBox& box) noexcept {
  BoxedParameters result{mean, {}, false};
  const auto clamped = [&](int q, double v) { return std::clamp(v, box.low[q], box.high[q]); };
  if (unknowns == 1) {
    result.value[0] = clamped(0, mean[0]);
    result.moved = result.value[0] != mean[0];
    if (result.moved && V[0][0] > 0.0) result.multiplier[0] = (result.value[0] - mean[0]) / V[0][0];
    return result;
  }
  if (clamped(0, mean[0]) == mean[0] && clamped(1, mean[1]) == mean[1]) return result;
  result.moved = true;
  // The minimum lies on an edge: on each of the (at most two) edges that the mean is beyond, move
  // along the covariance, then clamp along the edge; the cheaper one counts.
  const double determinant = V[0][0] * V[1][1] - V[0][1] * V[1][0];
  double least = 0.0;
  bool found = false;
  for (int q = 0; q < 2; ++q) {
    const int r = 1 - q;
    if (clamped(q, mean[q]) == mean[q] || !(V[q][q] > 0.0)) continue;
    Parameters p;
    p[q] = clamped(q, mean[q]);
    p[r] = clamped(r, mean[r] + V[r][q] / V[q][q] * (p[q] - mean[q]));
    const double dq = p[0] - mean[0];
    const double dr = p[1] - mean[1];
    Parameters multiplier{};
    if (determinant > 0.0) {
      multiplier = {(V[1][1] * dq - V[0][1] * dr) / determinant,
                    (V[0][0] * dr - V[1][0] * dq) / determinant};
    } else {
      multiplier[q] = (p[q] - mean[q]) / V[q][q];
    }
    const double cost = multiplier[0] * dq + multiplier[1] * dr;
    if (found && !(cost < least)) continue;
    found = true;
    least = cost;
    result.value = p;
    result.multiplier = multiplier;
  }
  if (!found) result.value = {clamped(0, mean[0]), clamped(1, mean[1])};
  return result;
}

}  // namespace photocoag
