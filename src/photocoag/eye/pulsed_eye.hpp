// Role: simulation; laser, tissue and transducer, pulse by pulse, with its own watchdog. Used by
// the eye's process, tests. Source: docs/devices.md, "The simulated eye"; docs/photoacoustics.md.
// Units: SI. Real time: fire and settle are noexcept, bounded, allocation-free. Threads: one owner.
#pragma once

#include <cstdint>

#include "photocoag/eye/fault_script.hpp"
#include "photocoag/eye/pulsed_tissue.hpp"
#include "photocoag/photoacoustics/settings.hpp"
#include "photocoag/photoacoustics/transducer.hpp"
#include "photocoag/rt/eye_protocol.hpp"

namespace photocoag {

struct PulsedEyeSettings {
  double pulse_period = 1e-4;  ///< s
  double noise = 0.91;         ///< K per pulse
  PulseNoise noise_kind = PulseNoise::kTemperature;
  bool dark_is_silent = false;                  ///< true: in a treatment, 0 W gives no transient
  double probe_energy = kNoiseReferenceEnergy;  ///< J, of the second laser; its heat is not counted
  double probe_below =
      0.1e-6;  ///< J: weaker pulses, also those of 0 W, are measured with the probe
  double energy_fluctuation = 0.01;          ///< relative, of each pulse
  double energy_meter = 0.002;               ///< relative error of the meter
  double arrival_jitter = 1.5;               ///< converter samples
  double power_max = 1.0;                    ///< W; a larger command gives 0 W
  double codes_per_joule = 3000.0 / 2.6e-6;  ///< of cold tissue
  std::uint64_t seed = 1;
};

/// The controller's orders before a pulse.
struct EyeOrders {
  double power = 0.0;        ///< W, of the current control period, if `take`
  bool take = false;         ///< there is a command for this period
  std::uint64_t tokens = 0;  ///< number of commands that have fed the watchdog
  std::uint64_t seen = 0;    ///< token of the last command received
  bool safe_off = false;
  int pulses_per_period = 1;
  std::uint64_t begin = UINT64_MAX;  ///< control period of the treatment's cycle 0
};

class PulsedEye {
 public:
  /// Throws Error as PulsedTissue does. Allocates.
  PulsedEye(std::shared_ptr<const FullOrderModel> model, AbsorptionFactors absorption,
            const GrueneisenCurve& curve, const PulsedEyeSettings& settings, FaultScript& faults);

  /// Fires pulse `number`: decides the power and fills `record`. 0 W without a new token for two
  /// control periods or with the interlock open.
  void fire(std::uint64_t number, std::int64_t due_ns, const EyeOrders& orders,
            PulseRecord& record) noexcept;
  /// Heats the tissue with the pulse; returns the truth of the pulse period after it.
  PulseTruth settle() noexcept;

  /// Resets the tissue to cold.
  void cool() noexcept { tissue_.reset(); }
  /// A new controller: 0 W, interlock closed.
  void attach() noexcept;
  /// The controller has gone: 0 W.
  void dark() noexcept;
  bool vanished() const noexcept { return vanished_; }
  double late_ms() const noexcept { return late_ms_; }  ///< fault T1, of the last pulse
  /// K, normalised volume temperature just before the next pulse.
  double volume_before() const noexcept { return tissue_.before().volume; }
  std::size_t states() const noexcept { return tissue_.states(); }
  double power_max() const noexcept { return settings_.power_max; }
  /// True for a power from 0 to the laser's limit, W.
  bool takes(double power) const noexcept {
    constexpr double kRounding = 1e-9;
    return power >= 0.0 && power <= settings_.power_max * (1.0 + kRounding);
  }

 private:
  const ScriptedFault* active(EyeFault fault) const noexcept;
  double decide_power(const EyeOrders& orders) noexcept;
  void answer(std::uint64_t number, double energy, PulseRecord& record) noexcept;
  void apply_faults(const EyeOrders& orders, PulseRecord& record) noexcept;

  PulsedTissue tissue_;
  GrueneisenCurve curve_;
  double ambient_;
  PulsedEyeSettings settings_;
  FaultScript& faults_;
  Transducer transducer_;
  double cold_;  // Gamma(T_0)
  double power_ = 0.0;
  double energy_ = 0.0;  // of the pulse in flight
  std::uint64_t number_ = 0;
  std::uint64_t tokens_ = 0;
  std::uint64_t seen_ = 0;
  bool refused_ = false;  // the command in force
  std::uint64_t pulses_without_token_ = UINT64_MAX / 2;
  bool interlock_open_ = false;
  bool treating_ = false;    // from its cycle 0 on
  std::uint64_t cycle_ = 0;  // of the treatment
  bool vanished_ = false;
  double late_ms_ = 0.0;
  PulseReading previous_;
};

}  // namespace photocoag
