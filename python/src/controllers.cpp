#include "controllers.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "arrays.hpp"
#include "common.hpp"
#include "photocoag/rom/intersample.hpp"

namespace photocoag::python {
namespace {

constexpr const char* kSample = "a number of kelvins, NaN where there is no sample";
constexpr const char* kPower = "a finite number of watts";

// A missing sample is NaN or None.
double sample_of(nb::handle value) {
  if (value.is_none()) return std::numeric_limits<double>::quiet_NaN();
  if (PyFloat_CheckExact(value.ptr())) return PyFloat_AsDouble(value.ptr());
  return number_of("volume_temperature", value, kSample, true);
}

double power_of(nb::handle value) {
  if (PyFloat_CheckExact(value.ptr())) {
    const double power = PyFloat_AsDouble(value.ptr());
    if (std::isfinite(power)) return power;
  }
  return number_of("applied_power", value, kPower);
}

void check_period(const ReducedModel& model, const Config& config) {
  if (std::abs(model.period - config.control.period) <= 1e-9 * model.period) return;
  throw Error(ErrorParts{.key = "control.period_ms",
                         .problem = "the model is for another control period",
                         .found = fmt::format("{:g} ms, model for {:g} ms",
                                              config.control.period * 1e3, model.period * 1e3),
                         .accepted = "the model's period, or a model made for this one"});
}

nb::dict to_dict(const Estimate& estimate) {
  nb::dict dict;
  dict["volume_K"] = estimate.outputs.volume;
  dict["peak_K"] = estimate.outputs.peak;
  dict["peak_sigma_K"] = estimate.peak_sigma;
  dict["absorption_factor"] = estimate.absorption_factor;
  dict["absorption_sigma"] = estimate.absorption_sigma;
  return dict;
}

template <typename Maker>
auto made(const ReducedModel& model, const OwnedConfig& config, Maker make) {
  check_period(model, config.config());
  Config controlled;
  interruptible(
      [&](std::atomic<bool>&) { controlled = cached_controller_config(config.config(), model); });
  return make(controlled);
}

}  // namespace

OwnedController::OwnedController(const ReducedModel& model, const Config& config)
    : period_(model.period) {
  const ControlSettings& control = config.control;
  const EstimatorSettings& estimator = config.estimator;
  switch (control.solver) {
    case SolverKind::kDense:
      controller_ =
          std::make_unique<Choice>(std::in_place_type<Controller>, model, control, estimator);
      return;
#if PHOTOCOAG_HAS_OSQP
    case SolverKind::kOsqp:
      controller_ = std::make_unique<Choice>(
          std::in_place_type<BasicController<SparseOsqpController>>, model, control, estimator);
      return;
    case SolverKind::kOsqpCondensed:
      controller_ = std::make_unique<Choice>(
          std::in_place_type<BasicController<CondensedOsqpController>>, model, control, estimator);
      return;
#else
    default:
      throw Error({.key = "control.solver",
                   .problem = "this build has no OSQP",
                   .found = "a solver that needs it",
                   .accepted = "dense"});
#endif
  }
}

void bind_controller(nb::module_& module) {
  nb::class_<OwnedController>(
      module, "Controller",
      "The model predictive controller with its estimator: sample in, power out.\n\n"
      "Parameters\n----------\nmodel : ReducedModel\n    Made for ``control.period_ms``.\n"
      "config : Config\n\nRaises\n------\nConfigError\n    Bad settings, or a model for another "
      "period.\n\nExamples\n--------\n>>> controller = pc.Controller(pc.reduce(cfg), cfg)\n"
      ">>> power = controller.start()          # W, for the first period\n"
      ">>> power = controller.step(1.2, power)  # K, W -> W\n")
      .def(
          "__init__",
          [](OwnedController* self, const ReducedModel& model, const OwnedConfig& config) {
            made(model, config, [&](const Config& controlled) {
              new (self)
                  OwnedController(controller_model(model, controlled.estimator.timing), controlled);
            });
          },
          nb::arg("model"), nb::arg("config"))
      .def(
          "start",
          [](OwnedController& self) {
            return self.visit([](auto& controller) { return controller.decide().power; });
          },
          "Power of the first period, W.")
      .def(
          "step",
          [](OwnedController& self, nb::handle volume_temperature, nb::handle applied_power) {
            const Sample sample{.volume_temperature = sample_of(volume_temperature),
                                .applied_power = power_of(applied_power)};
            return self.visit([&](auto& controller) { return controller.step(sample).power; });
          },
          nb::arg("volume_temperature").none(), nb::arg("applied_power").none(),
          "One period: estimate, then decide.\n\nParameters\n----------\n"
          "volume_temperature : float\n    Sample at the end of the period, K over ambient; NaN or "
          "None: there is none.\napplied_power : float\n    What the laser emitted during the "
          "period, W.\n\nReturns\n-------\nfloat\n    Power of the coming period, W, from 0 to "
          "``control.power_max_W``.\n")
      .def_prop_ro(
          "estimate",
          [](OwnedController& self) {
            return self.visit([](auto& controller) { return to_dict(controller.estimate()); });
          },
          "The present estimate, K and 1.")
      .def(
          "outputs",
          [](OwnedController& self) {
            return self.visit([](auto& controller) {
              const Outputs outputs = controller.estimate().outputs;
              return nb::make_tuple(outputs.volume, outputs.peak);
            });
          },
          "Estimated (volume_K, peak_K).")
      .def_prop_ro("period", &OwnedController::period, "Control period, s.");
  nb::class_<OwnedEstimator>(
      module, "Estimator",
      "The configured estimator of temperature and absorption factor.\n\nParameters\n----------\n"
      "model : ReducedModel\n    Made for ``control.period_ms``.\nconfig : Config\n\nExamples\n"
      "--------\n>>> estimator = pc.Estimator(pc.reduce(cfg), cfg)\n>>> estimator.update(1.2, "
      "0.02)\n>>> estimator.absorption_factor\n")
      .def(
          "__init__",
          [](OwnedEstimator* self, const ReducedModel& model, const OwnedConfig& config) {
            check_period(model, config.config());
            const EstimatorSettings& settings = config.config().estimator;
            new (self) OwnedEstimator(controller_model(model, settings.timing), settings);
          },
          nb::arg("model"), nb::arg("config"))
      .def(
          "update",
          [](OwnedEstimator& self, nb::handle volume_temperature, nb::handle applied_power) {
            const double sample = sample_of(volume_temperature);
            self.filter.predict(power_of(applied_power));
            self.filter.update(sample);
          },
          nb::arg("volume_temperature").none(), nb::arg("applied_power").none(),
          "One period: predict with the applied power, W, update with the sample, K.")
      .def_prop_ro(
          "state", [](const OwnedEstimator& self) { return array_of(self.filter.state()); },
          "Reduced state, shape (order,).")
      .def_prop_ro(
          "covariance",
          [](const OwnedEstimator& self) { return array_of(self.filter.covariance()); },
          "Covariance of (state, absorption factor), shape (order + 1, order + 1).")
      .def_prop_ro(
          "absorption_factor",
          [](const OwnedEstimator& self) { return self.filter.absorption_factor(); },
          "Estimated absorption factor alpha, 1.")
      .def_prop_ro(
          "absorption_sigma",
          [](const OwnedEstimator& self) { return self.filter.absorption_sigma(); },
          "Its standard deviation, 1.")
      .def(
          "outputs",
          [](const OwnedEstimator& self) {
            const Outputs outputs = self.filter.outputs();
            return nb::make_tuple(outputs.volume, outputs.peak);
          },
          "Estimated (volume_K, peak_K).");
}

}  // namespace photocoag::python
