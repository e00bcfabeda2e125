// Role: the Python package; a user's plant, estimator and controller in the closed loop. Source:
// the concepts Plant, Estimator and Controlling. Units: SI. Threads: the GIL is held throughout.
// The loop is noexcept: the first exception is kept, the loop is asked to stop, and the exception
// is raised after it.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <exception>
#include <optional>

#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/innovation.hpp"

namespace photocoag::python {

namespace nb = nanobind;

/// The first Python exception during a loop.
class Failure {
 public:
  explicit Failure(std::atomic<bool>& stop) : stop_(&stop) {}

  /// Calls f unless an earlier call has failed.
  template <typename F>
  void guard(F f) noexcept {
    if (first_) return;
    try {
      f();
    } catch (...) {
      first_ = std::current_exception();
      stop_->store(true, std::memory_order_relaxed);
    }
  }
  void rethrow() const {
    if (first_) std::rethrow_exception(first_);
  }

 private:
  std::atomic<bool>* stop_;
  std::exception_ptr first_;
};

/// `step(power_W)` and `outputs() -> (volume_K, peak_K)`.
class PythonPlant {
 public:
  PythonPlant(nb::handle object, Failure& failure);
  void step(double power) noexcept;
  Outputs outputs() const noexcept;

 private:
  nb::object step_, outputs_;
  Failure* failure_;
};

/// `update(volume_temperature_K, applied_power_W)`, then `state`, `absorption_factor` and, if
/// present, `covariance` and `absorption_sigma`. Missing attributes come from the configured filter
/// on the same samples; the Kalman filter replaces the posterior, whose state is not the model's.
class PythonEstimator {
 public:
  PythonEstimator(nb::handle object, const ReducedModel& model, const EstimatorSettings& settings,
                  Failure& failure);

  void reset() noexcept {}
  void predict(double power) noexcept;
  UpdateStatus update(double volume_temperature) noexcept;
  const StateVector& state() const noexcept { return state_; }
  const ParametricMatrices& matrices() const noexcept { return matrices_; }
  const ExtendedMatrix& covariance() const noexcept { return covariance_; }
  Outputs outputs() const noexcept;
  double peak_sigma() const noexcept;
  double absorption_factor() const noexcept { return absorption_factor_; }
  double absorption_sigma() const noexcept { return absorption_sigma_; }
  double choroid_factor() const noexcept { return choroid_factor_; }
  double choroid_sigma() const noexcept { return filter_.choroid_sigma(); }
  double innovation() const noexcept { return filter_.innovation(); }
  double innovation_sigma() const noexcept { return filter_.innovation_sigma(); }

 private:
  void read() noexcept;

  nb::object object_;
  nb::object update_;
  Failure* failure_;
  ReducedModel model_;
  AnyEstimator filter_;
  StateVector state_;
  ParametricMatrices matrices_;
  ExtendedMatrix covariance_;
  double power_ = 0.0;
  double absorption_factor_ = 1.0;
  double absorption_sigma_ = 0.0;
  double choroid_factor_ = 1.0;
};

/// `step(volume_temperature_K, applied_power_W) -> power_W`; before the first period `start()` if
/// present, else step(0, 0): tissue at ambient. Estimates are those of `F` unless the object has
/// `outputs()`.
template <Estimator F>
class PythonController {
 public:
  PythonController(nb::handle object, F filter, double power_max, Failure& failure);

  Estimate observe(const Sample& sample) noexcept;
  Decision decide() noexcept;
  Estimate estimate() const noexcept;
  const F& filter() const noexcept { return filter_; }

 private:
  void ask(double volume_temperature, double applied_power);
  void take(nb::handle power);

  nb::object object_, step_, outputs_;
  Failure* failure_;
  F filter_;
  double power_max_;
  double power_ = 0.0;     // of the coming period, W
  double previous_ = 0.0;  // power written last, W
  bool started_ = false;
  std::optional<Outputs> said_;
};

template <Estimator F>
Innovation innovation_of(const PythonController<F>& controller) noexcept {
  return {controller.filter().innovation(), controller.filter().innovation_sigma()};
}

}  // namespace photocoag::python
