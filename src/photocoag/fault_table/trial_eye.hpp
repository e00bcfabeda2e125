// Role: safety tests; the eye of a trial of the fault table, on the full-order model. Used by
// fault_trials. Source: docs/safety.md (rows O6, O7, O13 to O17). Units: W, K. Real time: none.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>

#include "photocoag/core/outputs.hpp"
#include "photocoag/fom/intersample_plant.hpp"
#include "photocoag/fom/stepper.hpp"

namespace photocoag {

/// An eye whose absorption changes: heat from before a change stays where it was absorbed.
class ChangingEye {
 public:
  /// `later`: the eye after the full change. From cycle `start` on the change progresses by the
  /// fraction `step` per period.
  ChangingEye(FullOrderPlant first, std::optional<FullOrderPlant> later, std::uint64_t start,
              double step)
      : first_(std::move(first)), later_(std::move(later)), start_(start), step_(step) {}
  void step(double power) noexcept {
    const std::uint64_t cycle = cycle_++;
    const double share = later_ && cycle >= start_
                             ? std::min(1.0, step_ * static_cast<double>(cycle - start_ + 1))
                             : 0.0;
    first_.step((1.0 - share) * power);
    if (later_) later_->step(share * power);
  }
  Outputs outputs() const noexcept {
    const Outputs first = first_.outputs();
    if (!later_) return first;
    const Outputs later = later_->outputs();
    return {.volume = first.volume + later.volume, .peak = first.peak + later.peak};
  }

 private:
  FullOrderPlant first_;
  std::optional<FullOrderPlant> later_;
  std::uint64_t start_;
  double step_;
  std::uint64_t cycle_ = 0;
};

/// The eye of a trial: one that changes, or one with wrong intersample timing.
class TrialEye {
 public:
  explicit TrialEye(ChangingEye eye) : eye_(std::move(eye)) {}
  explicit TrialEye(IntersamplePlant eye) : eye_(std::move(eye)) {}
  void step(double power) noexcept {
    if (auto* changing = std::get_if<ChangingEye>(&eye_)) return changing->step(power);
    std::get_if<IntersamplePlant>(&eye_)->step(power);
  }
  Outputs outputs() const noexcept {
    if (const auto* changing = std::get_if<ChangingEye>(&eye_)) return changing->outputs();
    return std::get_if<IntersamplePlant>(&eye_)->outputs();
  }
  double sample() const noexcept {
    if (const auto* changing = std::get_if<ChangingEye>(&eye_)) return changing->outputs().volume;
    return std::get_if<IntersamplePlant>(&eye_)->sample();
  }

 private:
  std::variant<ChangingEye, IntersamplePlant> eye_;
};

}  // namespace photocoag
