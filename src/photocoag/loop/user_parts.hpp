// Role: simulation; type-erased plant and controller: one compiled loop for all plants, and parts
// that users supply later (the Python package). Used by run, python. Units: SI. Real time: no
// promise for user-supplied parts.
#pragma once

#include <optional>

#include "photocoag/core/outputs.hpp"
#include "photocoag/loop/innovation.hpp"
#include "photocoag/loop/plant.hpp"
#include "photocoag/loop/treatment_loop.hpp"

namespace photocoag {

/// Refers to a Plant owned by the caller. Copies share it.
class PlantRef {
 public:
  /// `plant` must outlive this.
  template <Plant P>
  explicit PlantRef(P& plant)
      : plant_(&plant),
        step_([](void* p, double power) noexcept { static_cast<P*>(p)->step(power); }),
        outputs_([](void* p) noexcept { return static_cast<P*>(p)->outputs(); }),
        sample_([](void* p, double at_the_end) noexcept {
          return sample_of(*static_cast<const P*>(p), at_the_end);
        }) {}

  void step(double power) noexcept { step_(plant_, power); }
  Outputs outputs() const noexcept { return outputs_(plant_); }
  friend double sample_of(const PlantRef& own, double at_the_end) noexcept {
    return own.sample_(own.plant_, at_the_end);
  }

 private:
  void* plant_;
  void (*step_)(void*, double) noexcept;
  Outputs (*outputs_)(void*) noexcept;
  double (*sample_)(void*, double at_the_end) noexcept;
};

/// Refers to a controller owned by the caller, see Controlling. Copies share it.
class ControllerRef {
 public:
  /// `controller` must outlive this.
  template <Controlling C>
  explicit ControllerRef(C& controller)
      : controller_(&controller),
        observe_([](void* c, const Sample& sample) noexcept {
          return static_cast<C*>(c)->observe(sample);
        }),
        decide_([](void* c) noexcept { return static_cast<C*>(c)->decide(); }),
        estimate_([](void* c) noexcept { return static_cast<C*>(c)->estimate(); }),
        innovation_([](void* c) noexcept { return innovation_of(*static_cast<const C*>(c)); }) {}

  Estimate observe(const Sample& sample) noexcept { return observe_(controller_, sample); }
  Decision decide() noexcept { return decide_(controller_); }
  Estimate estimate() const noexcept { return estimate_(controller_); }
  friend Innovation innovation_of(const ControllerRef& own) noexcept {
    return own.innovation_(own.controller_);
  }

 private:
  void* controller_;
  Estimate (*observe_)(void*, const Sample&) noexcept;
  Decision (*decide_)(void*) noexcept;
  Estimate (*estimate_)(void*) noexcept;
  Innovation (*innovation_)(void*) noexcept;
};

static_assert(Plant<PlantRef> && Controlling<ControllerRef>);

/// User-supplied parts; empty: the built-in ones.
struct UserParts {
  std::optional<PlantRef> plant;
  std::optional<ControllerRef> controller;
};

}  // namespace photocoag
