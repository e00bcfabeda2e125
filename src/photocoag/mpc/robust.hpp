// Role: online; the peak limit with a margin. Used by loop when `control.robust` is "certified".
// Source: derived here; docs/control.md (robust mode), with what it does not guarantee. Units: SI.
// Real time: observe() and tighten() are noexcept, bounded and allocation-free. Threads: one
// owner.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "photocoag/mpc/ocp.hpp"
#include "photocoag/rom/certificate.hpp"

namespace photocoag {

/// y_k <= y_max with, instead of the estimate's y_k, the upper bound
///   C A^k x + s sigma_k + e_k + sum_j (max_beta C A^(k-1-j) B(alpha_high, beta) + m_(k-1-j)) u_j
/// alpha_high: s standard deviations above the estimate; beta: s below or above its own, if it is
/// estimated. sigma_k: of C A^k x. e_k, m_i: the model's running error bound of the powers applied
/// so far and of those to come, its largest scale between alpha_low and alpha_high. All
/// coefficients of u_j are non-negative, so that 0 W is the safest.
class RobustLimit {
 public:
  /// The filter's estimate of the absorption: means and standard deviations.
  struct Absorption {
    double alpha;
    double alpha_sigma;
    double beta = 1.0;
    double beta_sigma = 0.0;
  };

  /// `most`: the filter's upper bounds. Throws Error if the model has no certificate or the
  /// settings are bad.
  RobustLimit(const ReducedModel& model, const ControlSettings& settings, AbsorptionFactors most);

  /// One period with `power`, W.
  void observe(double power) noexcept;

  /// `covariance`: of (x, alpha), at least (order + 1) square. `delayed`: the controller's delay is
  /// one period, before which `pending`, W, still acts; without delay 0. Valid until the next call.
  template <typename Covariance>
  const LimitTightening& tighten(const Covariance& covariance, const Absorption& absorption,
                                 bool delayed, double pending) noexcept {
    for (int k = 0; k < stages_; ++k) {
      const auto row = peak_powers_.row(k + 1);
      const double variance =
          row.dot((covariance.topLeftCorner(row.size(), row.size()) * row.transpose()).eval());
      sigma_[k] = variance > 0.0 ? std::sqrt(variance) : 0.0;
    }
    return finish(absorption, delayed, pending);
  }

 private:
  const LimitTightening& finish(const Absorption& absorption, bool delayed,
                                double pending) noexcept;
  double largest_scale(double low, double high) const noexcept;

  ReducedModel model_;
  ErrorCertificate certificate_;
  double sigmas_;
  double power_max_;
  AbsorptionFactors most_;
  int stages_;
  BoundedMatrix<kMaxHorizon, kMaxOrder> peak_powers_;  // row k: C_peak A^k
  InputVector sigma_;                                  // K, of C A^k x, k = 1 …
  std::vector<double> majorant_;                       // c_j lambda_j^i, stage by stage
  std::array<double, kMaxMajorantTerms> applied_{};    // b_j of the powers so far, W
  ParametricMatrices matrices_;
  StateVector estimated_;       // B at the estimate
  StateVector input_low_;       // B(alpha_high, beta_low); tightening_ has beta_high
  StateVector pending_excess_;  // of both over the estimate, times a pending power
  StateVector pending_excess_low_;
  LimitTightening tightening_;
};

}  // namespace photocoag
