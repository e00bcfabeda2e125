#include "user_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "arrays.hpp"
#include "photocoag/estimation/extended_system.hpp"

namespace photocoag::python {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// A required method. Throws Error.
nb::object method(nb::handle object, const char* part, const char* name, const char* accepted) {
  nb::object found_method = nb::getattr(object, name, nb::none());
  if (!PyCallable_Check(found_method.ptr())) refuse(part, object, accepted);
  return found_method;
}

Outputs outputs_of(const std::string& key, nb::handle value) {
  const std::vector<double> pair =
      numbers_of(key, value, 2, "two finite numbers, (volume_K, peak_K)");
  return {.volume = pair[0], .peak = pair[1]};
}

EstimatorSettings beside(EstimatorSettings settings) {
  if (settings.kind == EstimatorKind::kPosterior) settings.kind = EstimatorKind::kEkf;
  return settings;
}

nb::object attribute(nb::handle object, const char* name) {
  return nb::getattr(object, name, nb::none());
}

}  // namespace

PythonPlant::PythonPlant(nb::handle object, Failure& failure)
    : step_(method(object, "plant", "step", "an object with step(power) and outputs()")),
      outputs_(method(object, "plant", "outputs", "an object with step(power) and outputs()")),
      failure_(&failure) {}

void PythonPlant::step(double power) noexcept {
  failure_->guard([&] { step_(power); });
}

Outputs PythonPlant::outputs() const noexcept {
  Outputs result{.volume = kUnknown, .peak = kUnknown};
  failure_->guard([&] { result = outputs_of("plant.outputs()", outputs_()); });
  return result;
}

PythonEstimator::PythonEstimator(nb::handle object, const ReducedModel& model,
                                 const EstimatorSettings& settings, Failure& failure)
    : object_(nb::borrow(object)),
      update_(method(object, "estimator", "update",
                     "an object with update(volume_temperature, applied_power), state and "
                     "absorption_factor")),
      failure_(&failure),
      model_(model),
      filter_(model, beside(settings)),
      state_(StateVector::Zero(model.order())),
      covariance_(filter_.covariance()),
      absorption_factor_(filter_.absorption_factor()),
      absorption_sigma_(filter_.absorption_sigma()),
      choroid_factor_(filter_.choroid_factor()) {
  model_.evaluate({absorption_factor_, choroid_factor_}, matrices_);
  read();
  failure_->rethrow();
}

void PythonEstimator::predict(double power) noexcept {
  power_ = power;
  filter_.predict(power);
}

UpdateStatus PythonEstimator::update(double volume_temperature) noexcept {
  const UpdateStatus status = filter_.update(volume_temperature);
  failure_->guard([&] { update_(volume_temperature, power_); });
  read();
  return status;
}

void PythonEstimator::read() noexcept {
  failure_->guard([&] {
    const auto order = static_cast<std::size_t>(model_.order());
    const nb::object state = attribute(object_, "state");
    const std::vector<double> x =
        numbers_of("estimator.state", state, order,
                   fmt::format("{} finite numbers, the model's order", order));
    state_ = Eigen::Map<const Eigen::VectorXd>(x.data(), model_.order());
    absorption_factor_ =
        number_of("estimator.absorption_factor", attribute(object_, "absorption_factor"),
                  "a finite number above 0");
    if (!(absorption_factor_ > 0.0)) {
      refuse("estimator.absorption_factor", attribute(object_, "absorption_factor"),
             "a finite number above 0");
    }
    const nb::object sigma = attribute(object_, "absorption_sigma");
    absorption_sigma_ = sigma.is_none()
                            ? filter_.absorption_sigma()
                            : number_of("estimator.absorption_sigma", sigma, "a finite number");
    covariance_ = filter_.covariance();
    const nb::object covariance = attribute(object_, "covariance");
    if (!covariance.is_none()) {
      const Eigen::Index size = covariance_.rows();
      const std::string accepted =
          fmt::format("{0} x {0} finite numbers, of (state, absorption)", size);
      const nb::object rows = nb::steal<nb::object>(PySequence_Fast(covariance.ptr(), ""));
      if (!rows.is_valid()) {
        PyErr_Clear();
        refuse("estimator.covariance", covariance, accepted);
      }
      if (PySequence_Size(rows.ptr()) != size) refuse("estimator.covariance", covariance, accepted);
      Eigen::Index row = 0;
      for (const nb::handle one : nb::cast<nb::iterable>(rows)) {
        const std::vector<double> values =
            numbers_of("estimator.covariance", one, static_cast<std::size_t>(size), accepted);
        covariance_.row(row++) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), size);
      }
    }
    model_.evaluate({absorption_factor_, choroid_factor_}, matrices_);
  });
}

Outputs PythonEstimator::outputs() const noexcept {
  return {.volume = matrices_.volume.dot(state_), .peak = model_.C_peak.dot(state_)};
}

double PythonEstimator::peak_sigma() const noexcept {
  return extended_peak_sigma(model_.C_peak, covariance_);
}

template <Estimator F>
PythonController<F>::PythonController(nb::handle object, F filter, double power_max,
                                      Failure& failure)
    : object_(nb::borrow(object)),
      step_(method(object, "controller", "step",
                   "an object with step(volume_temperature, applied_power) -> power")),
      outputs_(attribute(object, "outputs")),
      failure_(&failure),
      filter_(std::move(filter)),
      power_max_(power_max) {}

template <Estimator F>
void PythonController<F>::take(nb::handle power) {
  // Clamped: the laser saturates.
  power_ = std::clamp(number_of("controller.step()", power, "a finite number of watts"), 0.0,
                      power_max_);
  if (!outputs_.is_none()) said_ = outputs_of("controller.outputs()", outputs_());
}

template <Estimator F>
void PythonController<F>::ask(double volume_temperature, double applied_power) {
  take(step_(volume_temperature, applied_power));
}

template <Estimator F>
Estimate PythonController<F>::observe(const Sample& sample) noexcept {
  const double power = std::isfinite(sample.applied_power) ? sample.applied_power : previous_;
  filter_.predict(power);
  const UpdateStatus status = filter_.update(sample.volume_temperature);
  failure_->guard([&] { ask(sample.volume_temperature, power); });
  Estimate result = estimate();
  result.status = status;
  return result;
}

template <Estimator F>
Decision PythonController<F>::decide() noexcept {
  failure_->guard([&] {
    if (started_) return;
    started_ = true;
    const nb::object start = attribute(object_, "start");
    if (start.is_none()) return ask(0.0, 0.0);
    take(start());
  });
  const GateResult passed = gate(power_, power_max_);
  previous_ = passed.power;
  return {.power = passed.power,
          .power_reference = kUnknown,
          .status = MpcStatus::kSolved,
          .gate = passed.verdict};
}

template <Estimator F>
Estimate PythonController<F>::estimate() const noexcept {
  return {.outputs = said_.value_or(filter_.outputs()),
          .peak_sigma = filter_.peak_sigma(),
          .absorption_factor = filter_.absorption_factor(),
          .absorption_sigma = filter_.absorption_sigma(),
          .choroid_factor = filter_.choroid_factor(),
          .choroid_sigma = filter_.choroid_sigma(),
          .status = UpdateStatus::kNoSample};
}

template class PythonController<AnyEstimator>;
template class PythonController<PythonEstimator>;

}  // namespace photocoag::python
