// Role: online; posterior of several uncertain quantities given all samples so far. Used by loop.
// Source: docs/uncertainty.md: maximum a posteriori with Laplace's covariance; Bar-Shalom, Li and
// Kirubarajan (2001), ch. 2 and 3; considered quantities: Schmidt (1966). Differences: not a
// filter. The model's modes do not depend on the unknowns, so that three sums hold the whole record
// and every estimate uses all samples. Units: SI. Real time: predict and update are noexcept,
// bounded, allocation-free. Threads: one owner.
#pragma once

#include <memory>

#include "photocoag/core/outputs.hpp"
#include "photocoag/core/real_time.hpp"
#include "photocoag/estimation/extended_system.hpp"
#include "photocoag/estimation/outlier_gate.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/estimation/status.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

/// min over ln q:  (ln q - m)' C^-1 (ln q - m) + sum_k (y_k - R_vol(q)' x_k)^2 / sigma^2
///
/// with sum_k (...)^2 = sum y^2 - 2 R' sum x y + R' (sum x x') R: a Gauss-Newton step costs the
/// same after any number of samples. sigma^2 is a weighted mean of the prior's and the residuals'
/// variance. Covariance: (C^-1 + J' (sum x x') J / sigma^2)^-1, J = dR_vol / d ln q.
class PosteriorEstimator {
 public:
  /// Throws Error on bad settings, without a prior, or if the model was made for other quantities.
  PosteriorEstimator(const ReducedModel& model, const EstimatorSettings& settings);

  void reset() noexcept;
  /// One period with `power`, W.
  void predict(double power) noexcept PHOTOCOAG_NONBLOCKING;
  /// As ExtendedKalmanFilter::update.
  UpdateStatus update(double volume_temperature) noexcept PHOTOCOAG_NONBLOCKING;

  /// R_peak,i x_i, order entries: the coordinates of UncertainModel::control_model(), where C_peak
  /// = 1.
  const StateVector& state() const noexcept { return state_; }
  /// Input of that state and its derivative by alpha; the volume output is not filled.
  const ParametricMatrices& matrices() const noexcept { return matrices_; }
  /// Covariance of (state, alpha); only alpha's entry is filled.
  const ExtendedMatrix& covariance() const noexcept { return extended_covariance_; }
  /// Volume temperature as measured (calibration times the true one) and peak, K.
  Outputs outputs() const noexcept { return outputs_; }
  double peak_sigma() const noexcept { return peak_sigma_; }
  double absorption_factor() const noexcept;
  double absorption_sigma() const noexcept;
  double choroid_factor() const noexcept { return settings_.choroid_initial; }
  double choroid_sigma() const noexcept { return 0.0; }
  double innovation() const noexcept { return innovation_; }
  double innovation_sigma() const noexcept { return innovation_sigma_; }

  /// Estimate of ln q and its covariance, considered quantities included.
  const QuantityVector& log_quantities() const noexcept { return log_q_; }
  const QuantityMatrix& covariance_of_logs() const noexcept { return covariance_; }
  /// The same with every declared quantity estimated, considered ones too.
  const QuantityVector& joint_mean() const noexcept { return estimate_; }
  const QuantityMatrix& joint_covariance() const noexcept { return joint_; }
  const QuantityVector& prior_mean() const noexcept { return mean_; }
  const QuantityMatrix& prior_covariance() const noexcept { return prior_covariance_; }
  /// Over the samples used: sum of innovation^2 / its variance, and their number.
  double innovations() const noexcept { return innovations_; }
  double samples() const noexcept { return samples_; }
  /// Current estimate of a sample's standard deviation, K.
  double noise() const noexcept { return noise_; }
  /// Modes x_i after all powers so far, W s (rom/uncertain_model.hpp).
  const StateVector& modes() const noexcept { return x_; }
  /// `modes` one period with `power`, W, later.
  StateVector after(const StateVector& modes, double power) const noexcept {
    return decay_.cwiseProduct(modes) + gain_ * power;
  }
  const StateVector& peak_residue() const noexcept { return peak_residue_; }
  const ResidueSlopes& peak_slope() const noexcept { return peak_slope_; }
  const UncertainModel& model() const noexcept { return *model_; }

 private:
  void evaluate() noexcept;
  bool improve() noexcept;
  void publish() noexcept;
  bool healthy() const noexcept;

  std::shared_ptr<const UncertainModel> model_;
  EstimatorSettings settings_;
  StateVector decay_;
  StateVector gain_;
  bool averaged_ = false;  // samples are means over the pulses of a period
  StateVector before_;
  StateVector added_;
  int calibration_ = -1;  // index of the calibration quantity, -1: none declared
  QuantityVector mean_;
  QuantityMatrix prior_covariance_;
  QuantityMatrix prior_information_;
  QuantityVector low_;
  QuantityVector high_;

  StateVector x_;
  StateVector seen_;       // x as a sample sees it
  StateMatrix moment_;     // sum x x'
  StateVector correlate_;  // sum x y
  double squares_ = 0.0;   // sum y^2
  double samples_ = 0.0;
  double innovations_ = 0.0;
  double noise_ = 0.0;
  QuantityVector estimate_;  // of all ln q, considered ones included
  QuantityMatrix joint_;     // its covariance
  QuantityVector evaluated_at_;
  QuantityVector log_q_;
  QuantityMatrix covariance_;
  StateVector peak_residue_;
  StateVector sample_residue_;  // calibration included
  ResidueSlopes peak_slope_;
  ResidueSlopes sample_slope_;
  StateVector state_;
  ParametricMatrices matrices_;
  ExtendedMatrix extended_covariance_;
  Outputs outputs_;
  double peak_sigma_ = 0.0;
  OutlierGate gate_;
  double innovation_ = 0.0;
  double innovation_sigma_ = 0.0;
};

}  // namespace photocoag
