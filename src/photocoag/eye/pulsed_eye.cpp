#include "photocoag/eye/pulsed_eye.hpp"

#include <limits>

#include "photocoag/core/random.hpp"

namespace photocoag {

PulsedEye::PulsedEye(std::shared_ptr<const FullOrderModel> model, AbsorptionFactors absorption,
                     const GrueneisenCurve& curve, const PulsedEyeSettings& settings,
                     FaultScript& faults)
    : tissue_(model, settings.pulse_period, absorption, curve),
      curve_(curve),
      ambient_(model->tissue().ambient_celsius),
      settings_(settings),
      faults_(faults),
      cold_(curve.value(ambient_)) {}

void PulsedEye::attach() noexcept {
  dark();
  interlock_open_ = false;
  treating_ = false;
  seen_ = 0;
}

void PulsedEye::dark() noexcept {
  power_ = 0.0;
  refused_ = false;
  pulses_without_token_ = UINT64_MAX / 2;
}

const ScriptedFault* PulsedEye::active(EyeFault fault) const noexcept {
  return treating_ ? faults_.active(fault, cycle_) : nullptr;
}

double PulsedEye::decide_power(const EyeOrders& orders) noexcept {
  const bool deaf = active(EyeFault::kDeaf) != nullptr;
  ++pulses_without_token_;
  if (orders.tokens != tokens_ && !deaf) {
    tokens_ = orders.tokens;
    pulses_without_token_ = 0;
  }
  if (!deaf) seen_ = orders.seen;
  if (orders.take && !deaf) {
    refused_ = !takes(orders.power);
    power_ = refused_ ? 0.0 : orders.power;
  }
  if (orders.safe_off) interlock_open_ = true;
  const auto two_periods = 2 * static_cast<std::uint64_t>(orders.pulses_per_period);
  if (pulses_without_token_ >= two_periods) power_ = 0.0;
  double emitted = power_;
  if (const ScriptedFault* stuck = active(EyeFault::kStuckOn)) emitted = stuck->value;
  return interlock_open_ ? 0.0 : emitted;
}

void PulsedEye::fire(std::uint64_t number, std::int64_t due_ns, const EyeOrders& orders,
                     PulseRecord& record) noexcept {
  number_ = number;
  const auto per_period = static_cast<std::uint64_t>(orders.pulses_per_period);
  const std::uint64_t period = number / per_period;
  treating_ = period >= orders.begin;
  cycle_ = treating_ ? period - orders.begin : 0;
  const double power = decide_power(orders);
  const double fluctuation =
      1.0 + settings_.energy_fluctuation *
                standard_normal(settings_.seed, number, RandomStream::kPulseEnergy);
  energy_ = power * settings_.pulse_period * fluctuation;
  record.number = number;
  record.time_ns = due_ns;
  record.tokens = seen_;
  record.power_readback = power;
  record.period_power = power_;
  record.flags = (interlock_open_ ? kEyeInterlock : 0U) | (refused_ ? kEyeRefused : 0U);
  answer(number, energy_, record);
  if (treating_) apply_faults(orders, record);
}

void PulsedEye::answer(std::uint64_t number, double energy, PulseRecord& record) noexcept {
  PulseReading& reading = record.reading;
  const bool one_laser = settings_.dark_is_silent && treating_;
  if (energy == 0.0 && one_laser) {
    record.flags |= kEyeSilent;
    reading = {};
    return;
  }
  if (energy < settings_.probe_below && !one_laser) energy = settings_.probe_energy;
  double signal = tissue_.signal();
  const double celsius = ambient_ + tissue_.before().volume;
  if (const ScriptedFault* spike = active(EyeFault::kSpike)) {
    signal = curve_.value(celsius + spike->value);
  }
  const double amplitude = settings_.codes_per_joule * energy * signal / cold_;
  // (P6) solved for the converter noise that gives this noise in K.
  const bool in_kelvin = settings_.noise_kind == PulseNoise::kTemperature;
  const double at = in_kelvin ? celsius : ambient_;
  const double scale = in_kelvin ? energy : kNoiseReferenceEnergy;
  double noise = settings_.noise * curve_.slope(at) / cold_ * settings_.codes_per_joule * scale *
                 transducer_.gain();
  if (const ScriptedFault* louder = active(EyeFault::kNoise)) noise *= louder->value;
  const auto normal = [&](RandomStream stream) {
    return standard_normal(settings_.seed, number, stream);
  };
  transducer_.write(amplitude, settings_.arrival_jitter * normal(RandomStream::kArrivalTime), noise,
                    settings_.seed, number, reading.transient);
  reading.energy = energy * (1.0 + settings_.energy_meter * normal(RandomStream::kEnergyMeter));
}

void PulsedEye::apply_faults(const EyeOrders& orders, PulseRecord& record) noexcept {
  PulseReading& reading = record.reading;
  if (active(EyeFault::kStuck) != nullptr) reading = previous_;
  previous_ = reading;
  if (active(EyeFault::kMissing) != nullptr) {
    record.flags |= kEyeSilent;
    reading = {};
  }
  if (active(EyeFault::kNotANumber) != nullptr) {
    reading.energy = std::numeric_limits<double>::quiet_NaN();
  }
  if (active(EyeFault::kRail) != nullptr) {
    for (std::size_t i = 40; i < 60; ++i) reading.transient.codes[i] = kConverterRail;
  }
  const auto period_ns =
      static_cast<std::int64_t>(settings_.pulse_period * 1e9 + 0.5) * orders.pulses_per_period;
  if (active(EyeFault::kOld) != nullptr) record.time_ns -= 2 * period_ns;
  if (active(EyeFault::kFuture) != nullptr) record.time_ns += 3'600'000'000'000;
  if (const ScriptedFault* wrong = active(EyeFault::kReadback)) {
    record.power_readback *= wrong->value;
  }
  if (const ScriptedFault* which = active(EyeFault::kSwitch)) {
    record.flags |= which->value == 0.0   ? kEyeShutter
                    : which->value == 1.0 ? kEyeInterlock
                                          : kEyeFootSwitch;
    energy_ = 0.0;  // each of them blocks the light
    record.power_readback = 0.0;
  }
  vanished_ = active(EyeFault::kVanish) != nullptr;
  const ScriptedFault* late = active(EyeFault::kLate);
  late_ms_ =
      late != nullptr && record.number % static_cast<std::uint64_t>(orders.pulses_per_period) == 0
          ? late->value
          : 0.0;
}

PulseTruth PulsedEye::settle() noexcept {
  tissue_.pulse(energy_);
  return {.number = number_,
          .peak_mean = tissue_.mean().peak,
          .peak_pulse = tissue_.peak_after(),
          .volume_mean = tissue_.mean().volume};
}

}  // namespace photocoag
