#include "photocoag/mpc/chance.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {
namespace {

// A treatment is a few nearly independent decisions, one per doubling of time: the uncertainty
// changes little from one cycle to the next, and hardly at all after about 20 ms
// (docs/uncertainty.md).
constexpr double kDecisions = 8.0;

}  // namespace

double normal_quantile(double probability) noexcept {
  // Bisection of the complementary error function, to the last bit: set-up only.
  double low = -10.0;
  double high = 10.0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double kept_deviations(double limit_probability) noexcept {
  return normal_quantile(limit_probability / kDecisions);
}

ChanceLimit::ChanceLimit(const UncertainModel& model, const ControlSettings& settings)
    : kappa_(kept_deviations(settings.limit_probability)),
      peak_max_(settings.peak_max),
      model_error_(model.peak_error_rms),
      stages_(settings.horizon - 1) {
  settings.validate();
  model.step_of(settings.period, decay_, gain_);
  x_.setZero(model.order());
  tightening_.input.setZero(model.order());
  tightening_.free.setZero(stages_);
  tightening_.impulse.setZero(stages_);
}

const LimitTightening& ChanceLimit::tighten(const UncertainState& now, const StateVector& input,
                                            const InputVector& powers) noexcept {
  const Eigen::Index m = now.covariance.rows();
  tightening_.input = input;
  x_ = now.modes;
  change_ = 0.0;
  for (int k = 0; k < stages_; ++k) {
    x_ = decay_.cwiseProduct(x_) + gain_ * powers[k];
    const double peak = now.peak_residue.dot(x_);
    const QuantityVector slope = now.peak_slope.transpose().lazyProduct(x_);
    double variance = 0.0;
    for (Eigen::Index j = 0; j < m; ++j) {
      for (Eigen::Index i = 0; i < m; ++i) variance += slope[i] * now.covariance(i, j) * slope[j];
    }
    // Without heat there is no uncertainty.
    const double relative =
        peak > 0.0
            ? std::sqrt(std::max(0.0, variance) / (peak * peak) + model_error_ * model_error_)
            : 0.0;
    if (k == 0) relative_sigma_ = relative;
    const double kept = peak_max_ * -std::expm1(-kappa_ * relative);
    change_ = std::max(change_, std::abs(kept - tightening_.free[k]));
    tightening_.free[k] = kept;
  }
  return tightening_;
}

}  // namespace photocoag
