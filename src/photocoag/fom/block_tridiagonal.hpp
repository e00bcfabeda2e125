// Role: offline and simulated eye; many tridiagonal systems at once. Used by fom/layered_stepper.
// Source: Golub and Van Loan, Matrix Computations, section 4.3. Layout: row, then system ("lane"),
// so that the innermost loops run over independent systems and vectorise. Real time: noexcept, no
// allocation.
#pragma once

#include <Eigen/Core>

#include "photocoag/core/types.hpp"

namespace photocoag {

/// Solves one block of symmetric tridiagonal systems with off-diagonal `coupling`, factorised as
/// LDL' with inverse pivots `inverse`: one pass down and one up in depth. rhs(j, lane) may read y
/// there.
template <Eigen::Index Lanes, typename RightHandSide>
inline void solve_block(Eigen::Index cells, const double* __restrict inverse,
                        const double* __restrict coupling, double* y,
                        RightHandSide&& rhs) noexcept {
  double carry[Lanes] = {};
  for (Eigen::Index j = 0; j < cells; ++j) {
    const double c = j == 0 ? 0.0 : coupling[j - 1];
    for (Eigen::Index l = 0; l < Lanes; ++l) {
      carry[l] = inverse[j * Lanes + l] * (rhs(j, l) - c * carry[l]);
      y[j * Lanes + l] = carry[l];
    }
  }
  for (Eigen::Index j = cells - 2; j >= 0; --j) {
    for (Eigen::Index l = 0; l < Lanes; ++l) {
      carry[l] = y[j * Lanes + l] - coupling[j] * inverse[j * Lanes + l] * carry[l];
      y[j * Lanes + l] = carry[l];
    }
  }
}

/// The same with complex pivots; rhs has the constant imaginary part per cell and lane of
/// imaginary(j, l).
template <Eigen::Index Lanes, typename Real, typename Imaginary>
inline void solve_block_complex(Eigen::Index cells, const double* __restrict inverse_re,
                                const double* __restrict inverse_im,
                                const double* __restrict coupling, double* __restrict y_re,
                                double* __restrict y_im, Real&& real,
                                Imaginary&& imaginary) noexcept {
  double re[Lanes] = {};
  double im[Lanes] = {};
  for (Eigen::Index j = 0; j < cells; ++j) {
    const double c = j == 0 ? 0.0 : coupling[j - 1];
    for (Eigen::Index l = 0; l < Lanes; ++l) {
      const double a = real(j, l) - c * re[l];
      const double b = imaginary(j, l) - c * im[l];
      const double p = inverse_re[j * Lanes + l];
      const double q = inverse_im[j * Lanes + l];
      re[l] = p * a - q * b;
      im[l] = p * b + q * a;
      y_re[j * Lanes + l] = re[l];
      y_im[j * Lanes + l] = im[l];
    }
  }
  for (Eigen::Index j = cells - 2; j >= 0; --j) {
    for (Eigen::Index l = 0; l < Lanes; ++l) {
      const double a = coupling[j] * re[l];
      const double b = coupling[j] * im[l];
      const double p = inverse_re[j * Lanes + l];
      const double q = inverse_im[j * Lanes + l];
      re[l] = y_re[j * Lanes + l] - (p * a - q * b);
      im[l] = y_im[j * Lanes + l] - (p * b + q * a);
      y_re[j * Lanes + l] = re[l];
      y_im[j * Lanes + l] = im[l];
    }
  }
}

}  // namespace photocoag
