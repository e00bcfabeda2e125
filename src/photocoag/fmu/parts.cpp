#include "photocoag/fmu/parts.hpp"

#include <bit>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/run/configured_eye.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

std::optional<Supervisor> supervisor_of(const Config& config) {
  if (!config.safety.supervised) return {};
  return begun_supervisor(safety_limits(config), observer_model(config),
                          passed_self_test(config.plant.noise));
}

}  // namespace

EyePart::Eye EyePart::make(const FmuSetup& setup, const Config& config) {
  return with_plant(config, setup.full, setup.reduced.get(), [&](auto tissue) -> Eye {
    return SimulatedEye(std::move(tissue), config.plant.noise, config.run.seed,
                        eye_settings(config));
  });
}

EyePart::EyePart(const FmuSetup& setup, const Config& config) : eye_(make(setup, config)) {
  reading_.sample = {.volume_temperature = 0.0, .applied_power = 0.0};
}

bool EyePart::accepts(std::span<const FmuValue> inputs) noexcept {
  return inputs[0].number >= 0.0 && inputs[0].number <= kMostFmuPower;
}

void EyePart::step(std::span<const FmuValue> inputs) noexcept {
  const auto pass = [&](auto* eye) {
    if (eye == nullptr) return;
    eye->write(inputs[0].number);
    reading_ = eye->advance(cycle_);
  };
  pass(std::get_if<0>(&eye_));
  pass(std::get_if<1>(&eye_));
  pass(std::get_if<2>(&eye_));
  pass(std::get_if<3>(&eye_));
  ++cycle_;
}

void EyePart::show(std::span<FmuValue> outputs) const noexcept {
  outputs[0].number = reading_.sample.volume_temperature;
  outputs[1].number = reading_.sample.applied_power;
  outputs[2].number = reading_.truth.volume;
  outputs[3].number = reading_.truth.peak;
}

ControllerPart::ControllerPart(const FmuSetup& setup, const Config& config)
    : controller_(controller_model(*setup.reduced, config.estimator.timing),
                  backed_off(config, setup.margin).control, config.estimator),
      supervisor_(supervisor_of(backed_off(config, setup.margin))),
      estimate_(controller_.estimate()),
      period_ns_(static_cast<std::int64_t>(config.control.period * 1e9 + 0.5)) {
  decide();
}

void ControllerPart::decide() noexcept {
  decision_ = controller_.decide();
  const ControllerReport report = report_of(estimate_, decision_, innovation_of(controller_));
  allowed_ = supervisor_ ? supervisor_->authorize(report) : Unsupervised().authorize(report);
  off_ = off_ || allowed_.open_interlock;
}

template <Supervision S>
void ControllerPart::observe(S& supervisor, const DeviceSample& sample,
                             const Readback& readback) noexcept {
  const SampleVerdict verdict = supervisor.check(sample, readback, DeviceStatus::kGood);
  estimate_ = controller_.observe(
      {.volume_temperature =
           verdict.usable ? sample.volume_temperature : std::numeric_limits<double>::quiet_NaN(),
       .applied_power = verdict.power});
}

void ControllerPart::step(std::span<const FmuValue> inputs) noexcept {
  const double volume = inputs[0].number;
  const auto end_of_period = static_cast<std::int64_t>(cycle_ + 1) * period_ns_;
  const DeviceSample sample{.status = DeviceStatus::kGood,
                            .volume_temperature = volume,
                            .raw = std::bit_cast<std::int64_t>(volume),
                            .sequence = cycle_ + 1,
                            .time_ns = end_of_period,
                            .now_ns = end_of_period};
  const Readback readback{.power = inputs[1].number, .interlock_closed = !off_};
  ++cycle_;
  if (supervisor_) {
    observe(*supervisor_, sample, readback);
  } else {
    Unsupervised none;
    observe(none, sample, readback);
  }
  decide();
}

void ControllerPart::show(std::span<FmuValue> outputs) const noexcept {
  outputs[0].number = off_ ? 0.0 : allowed_.power;
  outputs[1].number = decision_.power_reference;
  outputs[2].number = estimate_.outputs.peak;
  outputs[3].number = estimate_.peak_sigma;
  outputs[4].number = estimate_.outputs.volume;
  outputs[5].number = estimate_.absorption_factor;
  outputs[6].number = estimate_.absorption_sigma;
  outputs[7].whole = static_cast<std::int64_t>(decision_.status);
  outputs[8].whole = decision_.iterations;
  outputs[9].whole = decision_.limit_active ? 1 : 0;
  outputs[10].whole =
      static_cast<std::int64_t>(supervisor_ ? supervisor_->status().state : SafetyState::kTreating);
  outputs[11].whole = off_ ? 1 : 0;
}

FmuPart make_fmu_part(const FmuSetup& setup, const std::vector<FmuValue>& values) {
  const Config config = with_parameters(setup, values);
  if (setup.kind == FmuKind::kEye) return FmuPart(std::in_place_type<EyePart>, setup, config);
  return FmuPart(std::in_place_type<ControllerPart>, setup, config);
}

}  // namespace photocoag
