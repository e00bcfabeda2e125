#include "photocoag/campaign/batch_estimate.hpp"

#include <cmath>

#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

constexpr int kMostSteps = 60;
constexpr double kSettled = 1e-9;  // of ln q

// The model at one ln q, and its modes along the record.
struct Response {
  StateVector decay, gain, peak, volume;
  ResidueSlopes peak_slope, volume_slope;
};

int calibration_of(const UncertainModel& model) {
  for (std::size_t q = 0; q < model.quantities.size(); ++q) {
    if (model.quantities[q].kind == QuantityKind::kCalibration) return static_cast<int>(q);
  }
  return -1;
}

Eigen::VectorXd within_bounds(Eigen::VectorXd log_q, const UncertainModel& model) {
  for (Eigen::Index q = 0; q < log_q.size(); ++q) {
    const UncertainQuantity& quantity = model.quantities[static_cast<std::size_t>(q)];
    log_q[q] = std::min(std::max(log_q[q], std::log(quantity.low)), std::log(quantity.high));
  }
  return log_q;
}

}  // namespace

BatchEstimate batch_estimate(const UncertainModel& model, const Belief& belief,
                             const std::vector<SampledCycle>& record, std::size_t cycles,
                             double noise) {
  const auto count = static_cast<Eigen::Index>(model.count());
  const int calibration = calibration_of(model);
  const Eigen::MatrixXd prior = inverse(belief.covariance_matrix());
  const Eigen::VectorXd mean = Eigen::Map<const Eigen::VectorXd>(belief.mean.data(), count);
  const double weight = 1.0 / (noise * noise);
  Response at;
  model.step_of(model.period, at.decay, at.gain);
  BatchEstimate out;
  out.log_quantities = within_bounds(mean, model);
  StateVector x;
  for (int step = 0; step < kMostSteps; ++step) {
    model.evaluate(out.log_quantities, at.peak, at.peak_slope, at.volume, at.volume_slope);
    const double factor = calibration < 0 ? 1.0 : std::exp(out.log_quantities[calibration]);
    Eigen::MatrixXd information = prior;
    Eigen::VectorXd gradient = prior * (out.log_quantities - mean);
    x = StateVector::Zero(model.order());
    for (std::size_t k = 0; k < cycles; ++k) {
      x = at.decay.cwiseProduct(x) + at.gain * record[k].power;
      if (!std::isfinite(record[k].sample)) continue;
      const double shown = factor * at.volume.dot(x);
      Eigen::VectorXd row = factor * (at.volume_slope.transpose() * x);
      if (calibration >= 0) row[calibration] = shown;
      information += weight * row * row.transpose();
      gradient += weight * (shown - record[k].sample) * row;
    }
    const Eigen::VectorXd next =
        within_bounds(out.log_quantities - solve(information, gradient), model);
    const double moved = (next - out.log_quantities).cwiseAbs().maxCoeff();
    out.log_quantities = next;
    out.covariance = inverse(information);
    if (moved < kSettled) break;
  }
  model.evaluate(out.log_quantities, at.peak, at.peak_slope, at.volume, at.volume_slope);
  out.peak = at.peak.dot(x);
  const Eigen::VectorXd slope = at.peak_slope.transpose() * x / out.peak;
  out.relative_sigma =
      std::sqrt(slope.dot(out.covariance * slope) + std::pow(model.peak_error_rms, 2));
  return out;
}

}  // namespace photocoag
