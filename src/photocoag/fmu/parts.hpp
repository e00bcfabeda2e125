// Role: simulation; the two kinds of FMU: the simulated eye of `simulate`, and its controller with
// supervisor. One period per step, in the order of loop/treatment_loop.hpp, so that coupled they
// give `simulate`'s powers bit for bit (python/tests/test_fmu.py). Used by fmu.
// Units: SI. Real time: step() and show() are noexcept and allocate nothing. Threads: one owner.
// A part is its state: a copy continues where the original was.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "photocoag/config/config.hpp"
#include "photocoag/fmu/setup.hpp"
#include "photocoag/fom/intersample_plant.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rom/intersample.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

/// Inputs: power. Outputs: as fmu_variables().
class EyePart {
 public:
  /// Throws Error.
  EyePart(const FmuSetup& setup, const Config& config);

  void step(std::span<const FmuValue> inputs) noexcept;
  void show(std::span<FmuValue> outputs) const noexcept;
  /// True for a power from 0 to kMostFmuPower, W.
  static bool accepts(std::span<const FmuValue> inputs) noexcept;

 private:
  using Eye = std::variant<SimulatedEye<FullOrderPlant>, SimulatedEye<IntersamplePlant>,
                           SimulatedEye<ReducedPlant>, SimulatedEye<ReducedIntersamplePlant>>;
  static Eye make(const FmuSetup& setup, const Config& config);

  Eye eye_;
  Reading reading_;
  std::uint64_t cycle_ = 0;
};

/// Inputs: volume temperature, applied power. Outputs: as fmu_variables().
class ControllerPart {
 public:
  /// Decides the first power. Throws Error.
  ControllerPart(const FmuSetup& setup, const Config& config);

  void step(std::span<const FmuValue> inputs) noexcept;
  void show(std::span<FmuValue> outputs) const noexcept;
  static bool accepts(std::span<const FmuValue>) noexcept { return true; }

 private:
  void decide() noexcept;
  template <Supervision S>
  void observe(S& supervisor, const DeviceSample& sample, const Readback& readback) noexcept;

  Controller controller_;
  std::optional<Supervisor> supervisor_;  // none: safety.supervisor = "off"
  Estimate estimate_;
  Decision decision_;
  Authorization allowed_;
  std::int64_t period_ns_;
  std::uint64_t cycle_ = 0;
  bool off_ = false;
};

using FmuPart = std::variant<EyePart, ControllerPart>;

/// Throws Error.
FmuPart make_fmu_part(const FmuSetup& setup, const std::vector<FmuValue>& values);

}  // namespace photocoag
