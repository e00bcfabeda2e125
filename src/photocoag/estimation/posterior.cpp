#include "photocoag/estimation/posterior.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

// Gauss-Newton steps per sample: the first samples move the estimate far, later ones little.
constexpr int kMostSteps = 4;
// Another step follows one that moved the estimate by more than this fraction of its standard
// deviation.
constexpr double kSmallStep = 0.05;
// Within this change of ln q residues are linear to 1e-4 relative.
constexpr double kLinear = 0.01;

// L of A = L L', in place of the lower triangle; false if A is not positive definite.
bool factorise(QuantityMatrix& A) noexcept {
  const Eigen::Index m = A.rows();
  for (Eigen::Index j = 0; j < m; ++j) {
    double pivot = A(j, j);
    for (Eigen::Index k = 0; k < j; ++k) pivot -= A(j, k) * A(j, k);
    if (!(pivot > 0.0)) return false;
    A(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < m; ++i) {
      double sum = A(i, j);
      for (Eigen::Index k = 0; k < j; ++k) sum -= A(i, k) * A(j, k);
      A(i, j) = sum / A(j, j);
    }
  }
  return true;
}

// A^-1 of A = L L'.
void invert(const QuantityMatrix& L, QuantityMatrix& inverse_of_A) noexcept {
  const Eigen::Index m = L.rows();
  QuantityMatrix lower = QuantityMatrix::Zero(m, m);  // L^-1
  for (Eigen::Index j = 0; j < m; ++j) {
    lower(j, j) = 1.0 / L(j, j);
    for (Eigen::Index i = j + 1; i < m; ++i) {
      double sum = 0.0;
      for (Eigen::Index k = j; k < i; ++k) sum -= L(i, k) * lower(k, j);
      lower(i, j) = sum / L(i, i);
    }
  }
  inverse_of_A = lower.transpose().lazyProduct(lower);
}

double quadratic_form(const QuantityMatrix& P, const QuantityVector& g) noexcept {
  double sum = 0.0;
  for (Eigen::Index j = 0; j < g.size(); ++j) {
    for (Eigen::Index i = 0; i < g.size(); ++i) sum += g[i] * P(i, j) * g[j];
  }
  return std::max(0.0, sum);
}

}  // namespace

PosteriorEstimator::PosteriorEstimator(const ReducedModel& model, const EstimatorSettings& settings)
    : model_(model.uncertain), settings_(settings), gate_(settings.outlier_sigma) {
  settings.validate();
  const Belief& prior = settings.prior;
  if (!prior.declared()) {
    throw Error(ErrorParts{.key = "estimator.kind",
                           .problem = "there is no prior to start from",
                           .found = "\"posterior\"",
                           .accepted = "\"ekf\" or \"mhe\", or a configuration with [[prior]]"});
  }
  prior.validate();
  if (model_ == nullptr || model_->quantities != prior.quantities) {
    throw Error(ErrorParts{.key = "model.file",
                           .problem = "the model is not made for the quantities of [[prior]]",
                           .accepted = "a model that `photocoag reduce` made with this prior"});
  }
  model_->validate();
  model_->step_of(model_->period, decay_, gain_);
  averaged_ = !model_->seen_before.empty();
  before_.setZero(model_->order());
  added_.setZero(model_->order());
  for (int i = 0; averaged_ && i < model_->order(); ++i) {
    before_[i] = model_->seen_before[static_cast<std::size_t>(i)];
    added_[i] = model_->seen_power[static_cast<std::size_t>(i)] * gain_[i];
  }
  const int m = model_->count();
  mean_.resize(m);
  low_.resize(m);
  high_.resize(m);
  for (int q = 0; q < m; ++q) {
    const UncertainQuantity& quantity = prior.quantities[static_cast<std::size_t>(q)];
    mean_[q] = prior.mean[static_cast<std::size_t>(q)];
    low_[q] = std::log(quantity.low);
    high_[q] = std::log(quantity.high);
    if (quantity.kind == QuantityKind::kCalibration) calibration_ = q;
  }
  prior_covariance_ = prior.covariance_matrix();
  prior_information_ = inverse(prior.covariance_matrix());
  reset();
}

void PosteriorEstimator::reset() noexcept {
  const int n = model_->order();
  x_.setZero(n);
  seen_.setZero(n);
  moment_.setZero(n, n);
  correlate_.setZero(n);
  squares_ = 0.0;
  samples_ = 0.0;
  innovations_ = 0.0;
  noise_ = settings_.prior.noise > 0.0 ? settings_.prior.noise : settings_.measurement_noise;
  estimate_ = mean_;
  joint_ = prior_covariance_;
  innovation_ = 0.0;
  innovation_sigma_ = 0.0;
  gate_.reset();
  evaluate();
  publish();
}

void PosteriorEstimator::evaluate() noexcept {
  evaluated_at_ = estimate_;
  model_->evaluate(estimate_, peak_residue_, peak_slope_, sample_residue_, sample_slope_);
  if (calibration_ < 0) return;
  const double factor = std::exp(estimate_[calibration_]);
  sample_residue_ *= factor;
  sample_slope_ *= factor;
  sample_slope_.col(calibration_) = sample_residue_;
}

void PosteriorEstimator::predict(double power) noexcept {
  if (averaged_) seen_ = before_.cwiseProduct(x_) + added_ * power;
  x_ = decay_.cwiseProduct(x_) + gain_ * power;
  if (!averaged_) seen_ = x_;
  publish();
}

// One Gauss-Newton step and the covariance before it. True if it was large.
bool PosteriorEstimator::improve() noexcept {
  const Eigen::Index m = estimate_.size();
  const double weight = 1.0 / (noise_ * noise_);
  const StateVector residual = moment_.lazyProduct(sample_residue_) - correlate_;
  const ResidueSlopes weighted = moment_.lazyProduct(sample_slope_);
  QuantityMatrix information = prior_information_;
  information += weight * sample_slope_.transpose().lazyProduct(weighted);
  const QuantityVector from_mean = estimate_ - mean_;
  QuantityVector gradient = prior_information_.lazyProduct(from_mean);
  gradient += weight * sample_slope_.transpose().lazyProduct(residual);
  if (!factorise(information)) return false;
  invert(information, joint_);
  QuantityVector step = -joint_.lazyProduct(gradient);
  // At most one prior standard deviation per step: beyond that the slopes are not valid.
  double most = 1.0;
  for (Eigen::Index q = 0; q < m; ++q) {
    most = std::max(most, std::abs(step[q]) / std::sqrt(prior_covariance_(q, q)));
  }
  step /= most;
  double moved = 0.0;
  double far = 0.0;
  for (Eigen::Index q = 0; q < m; ++q) {
    const double next = std::clamp(estimate_[q] + step[q], low_[q], high_[q]);
    step[q] = next - estimate_[q];
    moved = std::max(moved, std::abs(step[q]) / std::sqrt(joint_(q, q)));
    far = std::max(far, std::abs(next - evaluated_at_[q]));
    estimate_[q] = next;
  }
  if (far > kLinear) {
    evaluate();
  } else {
    peak_residue_ += peak_slope_.lazyProduct(step);
    sample_residue_ += sample_slope_.lazyProduct(step);
  }
  return moved > kSmallStep;
}

UpdateStatus PosteriorEstimator::update(double volume_temperature) noexcept {
  if (!possible_sample(volume_temperature)) return UpdateStatus::kNoSample;
  QuantityVector row = sample_slope_.transpose().lazyProduct(seen_);
  innovation_ = volume_temperature - sample_residue_.dot(seen_);
  innovation_sigma_ = std::sqrt(noise_ * noise_ + quadratic_form(joint_, row));
  if (!gate_.passes(innovation_, innovation_sigma_)) return UpdateStatus::kOutlier;
  moment_ += seen_.lazyProduct(seen_.transpose());
  correlate_ += volume_temperature * seen_;
  squares_ += volume_temperature * volume_temperature;
  samples_ += 1.0;
  innovations_ += innovation_ * innovation_ / (innovation_sigma_ * innovation_sigma_);
  for (int step = 0; step < kMostSteps && improve(); ++step) {
  }
  // The residuals' variance, with the prior's weighted as equivalent samples.
  const double spread = settings_.prior.noise_spread;
  if (spread > 0.0) {
    const double prior_samples = 1.0 / (2.0 * spread * spread);
    const double used = joint_.size() == 0 ? 0.0
                                           : static_cast<double>(estimate_.size()) -
                                                 prior_information_.cwiseProduct(joint_).sum();
    const StateVector moved = moment_.lazyProduct(sample_residue_);
    const double residuals = std::max(
        0.0, squares_ - 2.0 * correlate_.dot(sample_residue_) + sample_residue_.dot(moved));
    const double noise0 =
        settings_.prior.noise > 0.0 ? settings_.prior.noise : settings_.measurement_noise;
    noise_ = std::sqrt((prior_samples * noise0 * noise0 + residuals) /
                       (prior_samples + std::max(0.0, samples_ - used)));
  }
  publish();
  if (!healthy()) {
    reset();
    return UpdateStatus::kRestarted;
  }
  return UpdateStatus::kUpdated;
}

// Updates what the accessors return.
void PosteriorEstimator::publish() noexcept {
  const Eigen::Index n = x_.size();
  const Eigen::Index m = estimate_.size();
  log_q_ = estimate_;
  covariance_ = joint_;
  // Considered quantities stay at their mean with their own covariance. The estimate's error is
  // independent of the data, hence of the part of the considered error that the data determine.
  for (Eigen::Index i = 0; i < m; ++i) {
    if (model_->quantities[static_cast<std::size_t>(i)].estimated) continue;
    log_q_[i] = mean_[i];
    for (Eigen::Index j = 0; j < m; ++j) {
      if (model_->quantities[static_cast<std::size_t>(j)].estimated) continue;
      covariance_(i, j) = prior_covariance_(i, j);
    }
  }
  state_ = peak_residue_.cwiseProduct(x_);
  outputs_ = {.volume = sample_residue_.dot(seen_), .peak = state_.sum()};
  const QuantityVector row = peak_slope_.transpose().lazyProduct(x_);
  peak_sigma_ = std::sqrt(quadratic_form(covariance_, row));
  matrices_.input = peak_residue_.cwiseProduct(gain_);
  matrices_.input_slope[0] = peak_slope_.col(0).cwiseProduct(gain_) / std::exp(log_q_[0]);
  matrices_.volume.setZero(n);
  matrices_.volume_slope[0].setZero(n);
  extended_covariance_.setZero(n + 1, n + 1);
  extended_covariance_(n, n) = absorption_sigma() * absorption_sigma();
}

double PosteriorEstimator::absorption_factor() const noexcept { return std::exp(log_q_[0]); }

double PosteriorEstimator::absorption_sigma() const noexcept {
  return absorption_factor() * std::sqrt(std::max(0.0, covariance_(0, 0)));
}

bool PosteriorEstimator::healthy() const noexcept {
  return moment_.allFinite() && std::isfinite(squares_) && estimate_.allFinite() &&
         joint_.allFinite() && std::isfinite(noise_) && noise_ > 0.0 &&
         std::isfinite(outputs_.peak) && std::isfinite(outputs_.volume) && state_.allFinite();
}

}  // namespace photocoag
