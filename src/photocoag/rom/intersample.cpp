#include "photocoag/rom/intersample.hpp"

#include <fmt/format.h>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/rom/discretize.hpp"

namespace photocoag {

WindowMean window_mean(const ReducedModel& model, Window window) {
  if (model.discretization != Discretization::kZeroOrderHold) {
    throw Error(ErrorParts{.key = "model.discretization",
                           .problem = "between the ends of periods a model must be exact in time",
                           .found = std::string(to_string(model.discretization)),
                           .accepted = "zero-order-hold"});
  }
  const Eigen::MatrixXd A = model.A;
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(A.rows(), A.rows());
  const auto until = [&](double fraction) {
    return discretize(A, fraction * model.period, Discretization::kZeroOrderHold);
  };
  WindowMean mean;
  const double span = (window.end - window.begin) * model.period;
  const DiscretePair end = until(window.end);
  // A times the mean of the input's integral is the mean transition less the identity.
  mean.state = span == 0.0 ? end.transition
                           : Eigen::MatrixXd((end.input - until(window.begin).input) / span);
  mean.input = inverse(A) * (mean.state - identity) * inverse(until(1.0).input);
  return mean;
}

ReducedModel with_intersample(const ReducedModel& model, const IntersampleTiming& timing) {
  const Eigen::Index n = model.order();
  if (2 * n > kMaxOrder) {
    throw Error(ErrorParts{.key = "model.order",
                           .problem = "samples within a period double the number of states",
                           .found = fmt::format("{}", n),
                           .accepted = fmt::format("at most {}", kMaxOrder / 2)});
  }
  const SampleWindows seen = sample_windows(timing);
  if (seen.share[1] > 1e-12 || seen.share[2] > 1e-12) {
    throw Error(ErrorParts{.key = "estimator.sample_lag_periods",
                           .problem = "a sample may not reach back beyond its period",
                           .accepted = "lags and averaging of at most 1 in sum"});
  }
  const WindowMean mean = window_mean(model, seen.window[0]);
  return with_shown_states(model, mean.state, mean.input * Eigen::MatrixXd(model.B_d));
}

ReducedModel controller_model(const ReducedModel& model, const IntersampleTiming& timing) {
  return timing.plain() ? model : with_intersample(model, timing);
}

ReducedIntersamplePlant::ReducedIntersamplePlant(const ReducedModel& model,
                                                 AbsorptionFactors absorption,
                                                 const IntersampleTiming& timing, double drift)
    : model_(model),
      absorption_(absorption),
      first_(absorption),
      drift_(drift),
      windows_(sample_windows(timing)),
      state_(StateVector::Zero(model.order())) {
  for (int k = 0; k < SampleWindows::kMost; ++k) {
    if (windows_.share[k] > 0.0) samples_[k] = make_view(windows_.window[k]);
  }
  const double end = 1.0 - timing.power_lag;
  end_ = make_view({end, end});
  model_.evaluate(absorption_, matrices_);
}

ReducedIntersamplePlant::View ReducedIntersamplePlant::make_view(Window window) const {
  const WindowMean mean = window_mean(model_, window);
  return {mean.state, mean.input};
}

StateVector ReducedIntersamplePlant::look(const View& view,
                                          const StateVector& heat) const noexcept {
  return view.state.lazyProduct(state_) + view.input.lazyProduct(heat);
}

void ReducedIntersamplePlant::step(double power) noexcept {
  if (drift_ != 0.0) {
    const double time = static_cast<double>(periods_) * model_.period;
    absorption_.alpha = drifted_absorption(first_.alpha, drift_, time);
    model_.evaluate(absorption_, matrices_);
  }
  ++periods_;
  const StateVector heat = matrices_.input * power;
  seen_twice_ = seen_once_[2];
  seen_once_ = seen_;
  for (int k = 0; k < SampleWindows::kMost; ++k) {
    if (windows_.share[k] == 0.0) continue;
    seen_[k] = windows_.share[k] * matrices_.volume.dot(look(samples_[k], heat));
  }
  sample_ = seen_[0] + seen_once_[1] + seen_twice_;
  const StateVector end = look(end_, heat);
  outputs_ = {.volume = matrices_.volume.dot(end), .peak = model_.C_peak.dot(end)};
  state_ = (model_.A_d.lazyProduct(state_) + heat).eval();
}

}  // namespace photocoag
