// Role: the program; opens the built-in devices and provides what a treatment needs of each beyond
// the calls of the loop. The only place where treatments differ by device. Used by run. Source:
// docs/devices.md. Units: SI.
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>

#include "photocoag/config/config.hpp"
#include "photocoag/device/device.hpp"
#include "photocoag/fom/sampled_plant.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/user_parts.hpp"
#include "photocoag/rom/intersample.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/driver_device.hpp"
#include "photocoag/rt/eye_device.hpp"
#include "photocoag/rt/last_resort.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/rt/udp_device.hpp"
#include "photocoag/run/configured_eye.hpp"
#include "photocoag/run/device_address.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/device_self_test.hpp"
#include "photocoag/run/eye_pacing.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

template <typename O>
concept OpenDevice = requires(O open, const O& constant, bool log_has_room, std::size_t cycles,
                              Treatment& treatment) {
  typename O::Refusal;                             // exception of a failed self-test
  { O::kAnySolver } -> std::convertible_to<bool>;  // false: `dense` only
  { open.device() } -> Device;
  { constant.model() } -> std::same_as<const ReducedModel&>;  // the controller's model
  { constant.timed() } -> std::same_as<bool>;                 // its clock is the monotonic one
  { constant.limits() } -> std::same_as<SafetyLimits>;
  { constant.observer() } -> std::same_as<ObserverModel>;
  { open.self_test(log_has_room) } -> std::same_as<SelfTestReport>;
  open.begin(cycles);      // the next period is cycle 0
  open.finish(treatment);  // adds the device's own report
};

/// Calls open(). A device that cannot be opened is a device fault, not bad input: DeviceError. An
/// Error that names a key is the configuration's.
template <typename F>
void of_the_device(F&& open) {
  try {
    open();
  } catch (const Error& error) {
    if (!error.parts().key.empty()) throw;
    throw DeviceError(error);
  }
}

/// Whether the configuration lets light out of a device that is not simulated.
inline bool may_emit(const Config& config) noexcept {
  return config.safety.supervised && config.safety.real_time == RealTimeMode::kEnforce;
}

/// The simulated eye of this process; paced by the clock if C is ClockPace.
template <Pace C>
class OpenSimulatedEye {
 public:
  using Refusal = Error;
  static constexpr bool kAnySolver = true;
  static constexpr bool kPaced = requires(C pace) { pace.start(); };

  /// `config` and what `plant` refers to must outlive this. `states`: of the full-order model; 0
  /// for a user's plant.
  OpenSimulatedEye(const Config& config, const ReducedModel& model, PlantRef plant,
                   std::size_t states, const PlantMismatch& mismatch)
      : config_(config),
        model_(controller_model(model, config.estimator.timing)),
        states_(states),
        has_self_test_(mismatch.self_test),
        device_(plant, config.plant.noise, config.run.seed, eye_settings(config, mismatch),
                C(config.control.period)) {}

  auto& device() noexcept { return device_; }
  const ReducedModel& model() const noexcept { return model_; }
  bool timed() const noexcept { return kPaced; }
  SafetyLimits limits() const { return safety_limits(config_); }
  ObserverModel observer() const { return observer_model(config_); }
  SelfTestReport self_test(bool log_has_room) const {
    return has_self_test_ ? self_test_eye(config_, log_has_room)
                          : passed_self_test(config_.plant.noise);
  }
  void begin(std::size_t) noexcept {
    if constexpr (kPaced) device_.pace().start();
  }
  void finish(Treatment& treatment) const noexcept { treatment.full_order_states = states_; }

 private:
  const Config& config_;
  ReducedModel model_;
  std::size_t states_;
  bool has_self_test_;
  SimulatedEye<PlantRef, C> device_;
};

/// The simulated eye of another process: connected, baseline measured, by the clock or in lockstep.
class OpenEye {
 public:
  using Refusal = DeviceError;
  static constexpr bool kAnySolver = false;

  /// `config` must outlive this. Throws DeviceError; Error if a key of the configuration is bad.
  OpenEye(const Config& config, DeviceAddress place, ModelStore& models, const RealTime& granted);

  EyeDevice& device() noexcept { return *device_; }
  const ReducedModel& model() const noexcept { return *model_; }
  bool timed() const noexcept { return !device_->in_lockstep(); }
  SafetyLimits limits() const;
  ObserverModel observer() const;
  SelfTestReport self_test(bool log_has_room);
  void begin(std::size_t cycles) { device_->begin(cycles); }
  void finish(Treatment& treatment);

 private:
  const Config& config_;
  DeviceAddress place_;
  int pulses_;
  EyePace pace_;
  std::optional<ReducedModel> model_;
  std::optional<EyeDevice> device_;
  std::optional<LastResort<EyeDevice>> last_resort_;
};

/// A device that brings its own samples by the monotonic clock (a vendor's driver, an acquisition
/// program): open and armed at 0 W.
template <Device D>
class OpenBench {
 public:
  using Refusal = DeviceError;
  static constexpr bool kAnySolver = false;

  /// D(where…, control period in s, whether light may come out of it). `config` must outlive this.
  /// Throws DeviceError; Error where a key of the configuration is bad.
  template <typename... Where>
  OpenBench(const Config& config, const DeviceAddress& place, ModelStore& models,
            const Where&... where)
      : config_(config),
        place_(place),
        model_(controller_model(models.reduced(), config.estimator.timing)) {
    of_the_device([&] { device_.emplace(where..., config.control.period, may_emit(config)); });
    last_resort_.emplace(*device_);
  }

  D& device() noexcept { return *device_; }
  const ReducedModel& model() const noexcept { return model_; }
  bool timed() const noexcept { return true; }
  SafetyLimits limits() const { return device_limits(config_); }
  ObserverModel observer() const { return device_observer(config_); }
  SelfTestReport self_test(bool log_has_room) {
    device_->begin();
    return photocoag::self_test(*device_, config_.control, log_has_room);
  }
  void begin(std::size_t) noexcept { device_->begin(); }
  void finish(Treatment& treatment) const {
    treatment.full_order_states = model_.full_order_states;
    treatment.device = DeviceReport{.name = fmt::format("{}, {}", word_of(place_), device_->name()),
                                    .pulse_peak_max = std::numeric_limits<double>::quiet_NaN(),
                                    .status = {},
                                    .pacing = {}};
    if constexpr (requires { device_->status(); }) treatment.device->status = device_->status();
  }

 private:
  const Config& config_;
  DeviceAddress place_;
  ReducedModel model_;
  std::optional<D> device_;
  std::optional<LastResort<D>> last_resort_;
};

/// Calls use(open) with the simulated eye of this process: on the user's plant, or on `eye`.
template <Pace C, typename Use>
void with_simulated_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                        const PlantMismatch& mismatch, const std::optional<PlantRef>& own,
                        Use use) {
  const auto with = [&](PlantRef plant, std::size_t states) {
    OpenSimulatedEye<C> open(config, model, plant, states, mismatch);
    use(open);
  };
  if (own) return with(*own, 0);
  const std::size_t states = eye.full ? eye.full->states() : eye.reduced->full_order_states;
  const auto with_ours = [&](auto plant) { with(PlantRef(plant), states); };
  if (eye.full && eye.sampled && !config.plant.bench.needs_intersample()) {
    return with_ours(SampledPlant(*eye.full, config.plant.discretization, config.control.period,
                                  config.plant.absorption(), config.cycles()));
  }
  with_plant(config, eye.full, eye.reduced, with_ours);
}

/// Calls use(open) with the device at `place`, whose models are already loaded. Throws Error, for a
/// device DeviceError.
template <typename Use>
void open_device(const Config& config, const DeviceAddress& place, ModelStore& models,
                 const RealTime& granted, Use use) {
  using Kind = DeviceAddress::Kind;
  const auto with_eye_here = [&]<Pace C>() {
    EyeModel eye;
    std::optional<ReducedModel> plant;
    if (config.plant.model == PlantModel::kFull) {
      eye.full = models.plant_full();
    } else {
      eye.reduced = &plant.emplace(models.plant_reduced());
    }
    with_simulated_eye<C>(config, models.reduced(), eye, {}, {}, use);
  };
  switch (place.kind) {
    case Kind::kVirtual:
      return with_eye_here.template operator()<VirtualPace>();
    case Kind::kPaced:
      return with_eye_here.template operator()<ClockPace>();
    case Kind::kEye:
    case Kind::kEyeOverSocket: {
      OpenEye open(config, place, models, granted);
      return use(open);
    }
    case Kind::kUdp: {
      OpenBench<UdpDevice> open(config, place, models, place.path, config.control.delay);
      return use(open);
    }
    case Kind::kDriver: {
      OpenBench<DriverDevice> open(config, place, models, place.path, place.settings);
      return use(open);
    }
  }
}

}  // namespace photocoag
