#include "photocoag/estimation/mhe.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace photocoag {

// The window's outputs as a linear function of (z_0, w) around an estimate, the covariance of the
// measured ones and what the last step needs of it. Row r stands for the r-th measured period.
struct MovingHorizonEstimator::Linearization {
  using Gradients = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                  kMaxWindow, kMaxExtended>;
  using WindowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                     kMaxWindow, kMaxWindow>;

  int rows = 0;
  std::array<int, kMaxWindow> period;  // of each row
  WindowVector impulse;                // C A^i B
  WindowVector error;                  // y_j - C x_j
  Gradients gradient;                  // J: row r, columns (x_0, p)
  SlopeMatrix end_slope;               // d x_end / d p
  WindowMatrix factor;                 // L, L L' = J P J' + s_u^2 G G' + s_y^2 I
  Gradients whitened;                  // L^-1 J P
};

namespace {

constexpr double kConverged = 1e-4;  // of a parameter's standard deviation

// v <- L^-1 v for columns of a row-major block.
template <typename Matrix, typename Columns>
void solve_lower(const Matrix& L, int rows, Columns& v) noexcept {
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < i; ++k) v.row(i) -= L(i, k) * v.row(k);
    v.row(i) /= L(i, i);
  }
}

}  // namespace

MovingHorizonEstimator::MovingHorizonEstimator(const ReducedModel& model,
                                               const EstimatorSettings& settings)
    : ExtendedEstimate(model, settings) {
  reset();
}

void MovingHorizonEstimator::reset() noexcept {
  const int n = order_;
  reset_estimate();
  periods_ = 0;
  power_.fill(0.0);
  sample_.fill(0.0);
  unknown_power_.fill(0.0);
  transition_.setIdentity(n, n);
  prior_mean_.setZero(n + unknowns_);
  for (int q = 0; q < unknowns_; ++q) prior_mean_[n + q] = parameters_[q];
  prior_covariance_ = covariance_;
  start_state_.setZero(n);
  iterations_ = 0;
}

// One step of an extended Kalman filter for the arrival cost, linearized at the window's estimate.
template <int U>
void MovingHorizonEstimator::absorb_oldest() noexcept {
  const int n = order_;
  const double u = power_[0] + unknown_power_[0];
  SlopeMatrix b(n, U);
  for (int q = 0; q < U; ++q) b.col(q) = matrices_.input_slope[q] * power_[0];
  const StateVector reached = model_.A_d.lazyProduct(start_state_) + matrices_.input * u;
  StateVector mean = model_.A_d.lazyProduct(prior_mean_.head(n)) + matrices_.input * power_[0];
  for (int q = 0; q < U; ++q) mean += b.col(q) * (prior_mean_[n + q] - parameters_[q]);
  prior_mean_.head(n) = mean;
  predict_covariance<U>(model_.A_d, decay_, matrices_.input, b, unknown_power_variance(),
                        drift_variance(settings_), prior_covariance_);
  if (!std::isnan(sample_[0])) {
    const double noise = sample_variance();
    const ExtendedVector h = measurement_row<U>(matrices_, reached);
    const ExtendedVector ph = prior_covariance_.lazyProduct(h);
    const ExtendedVector gain = ph / (h.dot(ph) + noise);
    double innovation = sample_[0] - matrices_.volume.dot(mean);
    for (int q = 0; q < U; ++q) innovation -= h[n + q] * (prior_mean_[n + q] - parameters_[q]);
    update_covariance(h, ph, gain, noise, prior_covariance_);
    prior_mean_ += gain * innovation;
  }
  start_state_ = reached;
  --periods_;
  std::copy(power_.begin() + 1, power_.begin() + 1 + periods_, power_.begin());
  std::copy(sample_.begin() + 1, sample_.begin() + 1 + periods_, sample_.begin());
  std::copy(unknown_power_.begin() + 1, unknown_power_.begin() + 1 + periods_,
            unknown_power_.begin());
}

template <int U>
void MovingHorizonEstimator::predict_as(double power) noexcept {
  if (periods_ == settings_.window) {
    absorb_oldest<U>();
  } else {
    transition_ = (model_.A_d.lazyProduct(transition_)).eval();
  }
  power_[periods_] = power;
  sample_[periods_] = std::numeric_limits<double>::quiet_NaN();
  unknown_power_[periods_] = 0.0;
  ++periods_;
  predict_estimate<U>(power);
}

void MovingHorizonEstimator::predict(double power) noexcept {
  unknowns_ == 1 ? predict_as<1>(power) : predict_as<2>(power);
}

template <int U>
UpdateStatus MovingHorizonEstimator::update_as(double volume_temperature) noexcept {
  const ExtendedVector h = measurement_row<U>(matrices_, state_);
  const double noise = sample_variance();
  innovation_ = volume_temperature - matrices_.volume.dot(state_);
  innovation_sigma_ = std::sqrt(h.dot(covariance_.lazyProduct(h)) + noise);
  if (!gate_.passes(innovation_, innovation_sigma_)) return UpdateStatus::kOutlier;
  sample_[periods_ - 1] = volume_temperature;
  Linearization at;
  double change = std::numeric_limits<double>::infinity();
  for (iterations_ = 0; iterations_ < kMaxIterations && !(change < kConverged); ++iterations_) {
    linearize(at);
    change = step(at);
  }
  finish(at);
  if (!healthy()) {
    reset();
    return UpdateStatus::kRestarted;
  }
  return UpdateStatus::kUpdated;
}

UpdateStatus MovingHorizonEstimator::update(double volume_temperature) noexcept {
  if (periods_ == 0 || !possible_sample(volume_temperature)) return UpdateStatus::kNoSample;
  return unknowns_ == 1 ? update_as<1>(volume_temperature) : update_as<2>(volume_temperature);
}

void MovingHorizonEstimator::linearize(Linearization& at) const noexcept {
  const int n = order_;
  const int columns = n + unknowns_;
  at.gradient.resize(periods_, columns);
  at.end_slope.setZero(n, unknowns_);
  StateVector x = start_state_;
  StateVector row = matrices_.volume;  // C A^j
  at.rows = 0;
  for (int j = 0; j < periods_; ++j) {
    at.impulse[j] = row.dot(matrices_.input);
    row = (model_.A_d.transpose().lazyProduct(row)).eval();
    const double u = power_[j] + unknown_power_[j];
    x = (model_.A_d.lazyProduct(x) + matrices_.input * u).eval();
    at.end_slope = (model_.A_d.lazyProduct(at.end_slope)).eval();
    for (int q = 0; q < unknowns_; ++q) at.end_slope.col(q) += matrices_.input_slope[q] * power_[j];
    if (std::isnan(sample_[j])) continue;
    const int r = at.rows++;
    at.period[r] = j;
    at.error[r] = sample_[j] - matrices_.volume.dot(x);
    for (int i = 0; i < n; ++i) at.gradient(r, i) = row[i];
    for (int q = 0; q < unknowns_; ++q) {
      at.gradient(r, n + q) =
          matrices_.volume_slope[q].dot(x) + matrices_.volume.dot(at.end_slope.col(q));
    }
  }
}

// A Gauss-Newton step: (z_0, w) given the measured rows, jointly normal a priori. Returns the
// largest change of a parameter in its standard deviations.
double MovingHorizonEstimator::step(Linearization& at) noexcept {
  const int n = order_;
  const int rows = at.rows;
  const int columns = n + unknowns_;
  const double power_variance = unknown_power_variance();
  const double noise = sample_variance();
  auto& L = at.factor;
  L.resize(rows, rows);
  at.whitened.resize(rows, columns);
  at.whitened = at.gradient.topRows(rows).lazyProduct(prior_covariance_);
  // G G' by its diagonals: entry (j, k) is entry (j - 1, k - 1) plus g_j g_k.
  for (int r = 0; r < rows; ++r) {
    for (int s = 0; s <= r; ++s) {
      L(r, s) = at.whitened.row(r).dot(at.gradient.row(s)) + (r == s ? noise : 0.0);
    }
  }
  for (int lag = 0; lag < periods_; ++lag) {
    double sum = 0.0;
    int r = 0;
    int s = 0;
    for (int k = 0; k + lag < periods_; ++k) {
      sum += at.impulse[k + lag] * at.impulse[k];
      while (r < rows && at.period[r] < k + lag) ++r;
      while (s < rows && at.period[s] < k) ++s;
      if (r < rows && s < rows && at.period[r] == k + lag && at.period[s] == k) {
        L(r, s) += power_variance * sum;
      }
    }
  }
  for (int r = 0; r < rows; ++r) {
    for (int s = 0; s <= r; ++s) {
      double value = L(r, s);
      for (int k = 0; k < s; ++k) value -= L(r, k) * L(s, k);
      L(r, s) = r == s ? std::sqrt(std::max(value, 0.0)) : value / L(s, s);
    }
  }
  solve_lower(L, rows, at.whitened);

  // Deviation of the rows from the prior's mean.
  ExtendedVector offset(columns);
  offset.head(n) = prior_mean_.head(n) - start_state_;
  for (int q = 0; q < unknowns_; ++q) offset[n + q] = prior_mean_[n + q] - parameters_[q];
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxWindow, 1> v(rows);
  for (int r = 0; r < rows; ++r) {
    double value = at.error[r] - at.gradient.row(r).dot(offset);
    for (int i = 0; i <= at.period[r]; ++i) {
      value += at.impulse[at.period[r] - i] * unknown_power_[i];
    }
    v[r] = value;
  }
  solve_lower(L, rows, v);
  ExtendedVector mean = prior_mean_;
  for (int r = 0; r < rows; ++r) mean += at.whitened.row(r).transpose() * v[r];

  double V[2][2] = {{0.0, 0.0}, {0.0, 0.0}};
  for (int q = 0; q < unknowns_; ++q) {
    for (int p = 0; p < unknowns_; ++p) {
      V[q][p] = prior_covariance_(n + q, n + p) -
                at.whitened.col(n + q).head(rows).dot(at.whitened.col(n + p).head(rows));
    }
  }
  Parameters wanted = parameters_;
  for (int q = 0; q < unknowns_; ++q) wanted[q] = mean[n + q];
  const BoxedParameters boxed = keep_inside(wanted, V, unknowns_, parameter_box(settings_));
  if (boxed.moved) {
    // State and unknown powers move with the parameters along the posterior covariance.
    for (int q = 0; q < unknowns_; ++q) {
      const auto along = at.whitened.col(n + q).head(rows);
      mean.head(n) += prior_covariance_.col(n + q).head(n) * boxed.multiplier[q];
      for (int r = 0; r < rows; ++r) {
        mean.head(n) -= at.whitened.row(r).head(n).transpose() * (along[r] * boxed.multiplier[q]);
      }
      v -= along * boxed.multiplier[q];
    }
  }
  // L^-T v, then w = s_u^2 G' L^-T v.
  for (int i = rows - 1; i >= 0; --i) {
    v[i] /= L(i, i);
    for (int k = 0; k < i; ++k) v[k] -= L(i, k) * v[i];
  }
  for (int i = 0; i < periods_; ++i) {
    double sum = 0.0;
    for (int r = 0; r < rows; ++r) {
      if (at.period[r] >= i) sum += at.impulse[at.period[r] - i] * v[r];
    }
    unknown_power_[i] = power_variance * sum;
  }
  double change = 0.0;
  for (int q = 0; q < unknowns_; ++q) {
    const double moved = std::abs(boxed.value[q] - parameters_[q]);
    if (moved > 0.0) change = std::max(change, moved / std::sqrt(std::max(V[q][q], 1e-300)));
    parameters_[q] = boxed.value[q];
  }
  start_state_ = mean.head(n);
  evaluate_at(model_, parameters_, matrices_);
  return change;
}

// State and covariance at the window's end.
void MovingHorizonEstimator::finish(const Linearization& at) noexcept {
  const int n = order_;
  const int rows = at.rows;
  const int columns = n + unknowns_;
  const double power_variance = unknown_power_variance();
  state_ = start_state_;
  for (int j = 0; j < periods_; ++j) {
    const double u = power_[j] + unknown_power_[j];
    state_ = (model_.A_d.lazyProduct(state_) + matrices_.input * u).eval();
  }
  // z_end = F z_0 + [Gm; 0] w, and its covariance with the rows: cross = L^-1 (J P F' + s_u^2 G
  // Gm').
  ExtendedMatrix F(columns, columns);
  F.setIdentity();
  F.topLeftCorner(n, n) = transition_;
  F.topRightCorner(n, unknowns_) = at.end_slope;
  Linearization::Gradients cross(rows, columns);
  cross.setZero();
  covariance_ = F.lazyProduct(prior_covariance_).eval().lazyProduct(F.transpose());
  StateVector reached = matrices_.input;  // A^(periods - 1 - i) B
  for (int i = periods_ - 1; i >= 0; --i) {
    for (int c = 0; c < n; ++c) {
      for (int d = 0; d < n; ++d) covariance_(d, c) += power_variance * reached[d] * reached[c];
    }
    for (int r = rows - 1; r >= 0 && at.period[r] >= i; --r) {
      cross.row(r).head(n) += power_variance * at.impulse[at.period[r] - i] * reached.transpose();
    }
    reached = (model_.A_d.lazyProduct(reached)).eval();
  }
  solve_lower(at.factor, rows, cross);
  cross += at.whitened.topRows(rows).lazyProduct(F.transpose());
  for (int c = 0; c < columns; ++c) {
    for (int d = 0; d <= c; ++d) {
      const double symmetric = 0.5 * (covariance_(d, c) + covariance_(c, d));
      covariance_(d, c) = covariance_(c, d) = symmetric - cross.col(c).dot(cross.col(d));
    }
  }
  // Rounding may make the variance of an exactly known direction negative.
  for (int c = 0; c < columns; ++c) covariance_(c, c) = std::max(covariance_(c, c), 0.0);
}

bool MovingHorizonEstimator::healthy() const noexcept {
  return finite_estimate() && prior_mean_.allFinite() && prior_covariance_.allFinite();
}

ExtendedVector MovingHorizonEstimator::start() const noexcept {
  ExtendedVector z(order_ + unknowns_);
  z.head(order_) = start_state_;
  for (int q = 0; q < unknowns_; ++q) z[order_ + q] = parameters_[q];
  return z;
}

ExtendedVector MovingHorizonEstimator::measurement_gradient(int j) const noexcept {
  Linearization at;
  linearize(at);
  for (int r = 0; r < at.rows; ++r) {
    if (at.period[r] == j) return at.gradient.row(r).transpose();
  }
  return ExtendedVector::Zero(order_ + unknowns_);
}

double MovingHorizonEstimator::predicted_volume(const ExtendedVector& start, int j) const noexcept {
  Parameters p = parameters_;
  for (int q = 0; q < unknowns_; ++q) p[q] = start[order_ + q];
  ParametricMatrices matrices;
  evaluate_at(model_, p, matrices);
  StateVector x = start.head(order_);
  for (int k = 0; k <= j; ++k) {
    x = (model_.A_d.lazyProduct(x) + matrices.input * power_[k] +
         matrices_.input * unknown_power_[k])
            .eval();
  }
  return matrices.volume.dot(x);
}

}  // namespace photocoag
