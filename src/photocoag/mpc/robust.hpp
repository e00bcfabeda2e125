// Role: online; the peak limit with a margin. Used by loop when `control.robust` is "certified".
// Source: derived here; docs/control.md (robust mode): what it is made of and what it does not
// guarantee. Units: SI. Real time: observe() and tighten() are noexcept, bounded and allocation-
// free. Threads: one owner.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "photocoag/mpc/ocp.hpp"
#include "photocoag/rom/certificate.hpp"

namespace photocoag {

/// y_k <= y_max with, instead of the estimate's y_k, the upper bound
///   C A^k x + s sigma_k + e_k + sum_j (C A^(k-1-j) B(alpha_high) + m_(k-1-j)) u_j
/// alpha_high: s standard deviations above the estimate. sigma_k: of C A^k x. e_k, m_i: the model's
/// running error bound of the powers applied so far and of those to come, its largest scale between
/// alpha_low and alpha_high. All coefficients of u_j are not negative, so that 0 W is the safest.
class RobustLimit {
 public:
  /// Throws Error if the model has no certificate or the settings are bad.
  RobustLimit(const ReducedModel& model, const ControlSettings& settings, double absorption_max);

  /// One period has passed with `power`, W.
  void observe(double power) noexcept;

  /// `covariance`: of (x, alpha), order + 1 square at least; `alpha`, `alpha_sigma`: the estimate.
  /// `pending`: power, W, of the period before stage 0, if it is not over yet; else 0. Valid until
  /// the next call.
  template <typename Covariance>
  const LimitTightening& tighten(const Covariance& covariance, double alpha, double alpha_sigma,
                                 bool delayed, double pending) noexcept {
    for (int k = 0; k < stages_; ++k) {
      const auto row = peak_powers_.row(k + 1);
      const double variance =
          row.dot((covariance.topLeftCorner(row.size(), row.size()) * row.transpose()).eval());
      sigma_[k] = variance > 0.0 ? std::sqrt(variance) : 0.0;
    }
    return finish(alpha, alpha_sigma, delayed, pending);
  }

 private:
  const LimitTightening& finish(double alpha, double alpha_sigma, bool delayed,
                                double pending) noexcept;
  double largest_scale(double low, double high) const noexcept;

  ReducedModel model_;
  ErrorCertificate certificate_;
  double sigmas_;
  double power_max_;
  double absorption_max_;
  int stages_;
  BoundedMatrix<kMaxHorizon, kMaxOrder> peak_powers_;  // row k: C_peak A^k
  InputVector sigma_;                                  // K, of C A^k x, k = 1 …
  std::vector<double> majorant_;                       // c_j lambda_j^i, stage by stage
  std::array<double, kMaxMajorantTerms> applied_{};    // b_j of the powers so far, W
  ParametricMatrices matrices_;
  StateVector pending_excess_;
  LimitTightening tightening_;
};

}  // namespace photocoag
