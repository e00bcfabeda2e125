// Role: online; the Estimator concept, and the estimator chosen by the settings. Used by loop.
// Real time: one branch per call, noexcept, no allocation.
#pragma once

#include <concepts>
#include <variant>

#include "photocoag/estimation/ekf.hpp"
#include "photocoag/estimation/mhe.hpp"
#include "photocoag/estimation/posterior.hpp"

namespace photocoag {

/// Models: ExtendedKalmanFilter, MovingHorizonEstimator, PosteriorEstimator, AnyEstimator.
template <typename E>
concept Estimator = requires(E estimator, const E& constant, double value) {
  { estimator.reset() }
  noexcept;
  { estimator.predict(value) }
  noexcept;
  { estimator.update(value) }
  noexcept->std::same_as<UpdateStatus>;
  { constant.state() }
  noexcept->std::same_as<const StateVector&>;
  { constant.matrices() }
  noexcept->std::same_as<const ParametricMatrices&>;
  { constant.covariance() }
  noexcept->std::same_as<const ExtendedMatrix&>;
  { constant.outputs() }
  noexcept->std::same_as<Outputs>;
  { constant.peak_sigma() }
  noexcept->std::same_as<double>;
  { constant.absorption_factor() }
  noexcept->std::same_as<double>;
  { constant.absorption_sigma() }
  noexcept->std::same_as<double>;
  { constant.choroid_factor() }
  noexcept->std::same_as<double>;
  { constant.choroid_sigma() }
  noexcept->std::same_as<double>;
  { constant.innovation() }
  noexcept->std::same_as<double>;
  { constant.innovation_sigma() }
  noexcept->std::same_as<double>;
};

/// The estimator of settings.kind.
class AnyEstimator {
 private:
  using Choice = std::variant<ExtendedKalmanFilter, MovingHorizonEstimator, PosteriorEstimator>;

  static Choice make(const ReducedModel& model, const EstimatorSettings& settings) {
    if (settings.kind == EstimatorKind::kMhe) return MovingHorizonEstimator(model, settings);
    if (settings.kind == EstimatorKind::kPosterior) return PosteriorEstimator(model, settings);
    return ExtendedKalmanFilter(model, settings);
  }

  // Not std::visit, which may throw and calls through a table.
  template <typename F>
  decltype(auto) visit(F f) noexcept {
    if (auto* filter = std::get_if<ExtendedKalmanFilter>(&estimator_)) return f(*filter);
    if (auto* all = std::get_if<PosteriorEstimator>(&estimator_)) return f(*all);
    return f(*std::get_if<MovingHorizonEstimator>(&estimator_));
  }
  template <typename F>
  decltype(auto) visit(F f) const noexcept {
    if (const auto* filter = std::get_if<ExtendedKalmanFilter>(&estimator_)) return f(*filter);
    if (const auto* all = std::get_if<PosteriorEstimator>(&estimator_)) return f(*all);
    return f(*std::get_if<MovingHorizonEstimator>(&estimator_));
  }

 public:
  AnyEstimator(const ReducedModel& model, const EstimatorSettings& settings)
      : estimator_(make(model, settings)) {}

  /// Null unless the kind is kPosterior.
  const PosteriorEstimator* posterior() const noexcept {
    return std::get_if<PosteriorEstimator>(&estimator_);
  }

  void reset() noexcept {
    visit([](auto& e) { e.reset(); });
  }
  void predict(double power) noexcept {
    visit([power](auto& e) { e.predict(power); });
  }
  UpdateStatus update(double volume_temperature) noexcept {
    return visit([volume_temperature](auto& e) { return e.update(volume_temperature); });
  }
  const StateVector& state() const noexcept {
    return visit([](const auto& e) -> const StateVector& { return e.state(); });
  }
  const ParametricMatrices& matrices() const noexcept {
    return visit([](const auto& e) -> const ParametricMatrices& { return e.matrices(); });
  }
  const ExtendedMatrix& covariance() const noexcept {
    return visit([](const auto& e) -> const ExtendedMatrix& { return e.covariance(); });
  }
  Outputs outputs() const noexcept {
    return visit([](const auto& e) { return e.outputs(); });
  }
  double peak_sigma() const noexcept {
    return visit([](const auto& e) { return e.peak_sigma(); });
  }
  double absorption_factor() const noexcept {
    return visit([](const auto& e) { return e.absorption_factor(); });
  }
  double absorption_sigma() const noexcept {
    return visit([](const auto& e) { return e.absorption_sigma(); });
  }
  double choroid_factor() const noexcept {
    return visit([](const auto& e) { return e.choroid_factor(); });
  }
  double choroid_sigma() const noexcept {
    return visit([](const auto& e) { return e.choroid_sigma(); });
  }
  double innovation() const noexcept {
    return visit([](const auto& e) { return e.innovation(); });
  }
  double innovation_sigma() const noexcept {
    return visit([](const auto& e) { return e.innovation_sigma(); });
  }

 private:
  Choice estimator_;
};

static_assert(Estimator<ExtendedKalmanFilter> && Estimator<MovingHorizonEstimator> &&
              Estimator<PosteriorEstimator> && Estimator<AnyEstimator>);

}  // namespace photocoag
