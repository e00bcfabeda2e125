// Role: offline and simulated eye; time stepping of the full-order model. Used by `response`, the
// full-order plant and the validation of reduced models: one code for all three.
// Source: paper, section 2 (implicit Euler); exact zero-order hold is ours. docs/equations.md (E7).
// Real time: step() is noexcept and does not allocate; everything else may.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/fom/layered_stepper.hpp"

namespace photocoag {

/// State of x' = A x + B(alpha) u, kept per mode and per unit of the mode's source:
///   temperature coordinate (i, j) = beam_i * source_j(alpha) * input_gain * state_ij.
/// From cold tissue the state depends on the power alone, so that one run serves every alpha:
/// outputs are two axial profiles weighted for that alpha (OutputWeights). Needs a separable model;
/// for others see LayeredStepper.
///
/// Per step of length h and mode of rate l: state+ = d * state + g * u with
///   zero-order hold  d = exp(-l h),    g = (1 - d) / l
///   implicit Euler   d = 1 / (1 + l h), g = h d
///   TR-BDF2          core/discretization.hpp with A = -l
/// A mode with d below `negligible_decay` has no memory at that relative accuracy; its share is g *
/// u, summed up beforehand.
class ModalStepper {
 public:
  /// negligible_decay = 0 steps every mode. Throws Error if the model is not separable.
  ModalStepper(std::shared_ptr<const FullOrderModel> model, Discretization discretization,
               double period, double negligible_decay = 1e-12);

  /// Changes h, keeping the state. A new value needs negligible_decay = 0 (else modes without
  /// memory have no state to keep): throws Error.
  void set_period(double period);
  /// Cold tissue.
  void reset() noexcept;
  /// One period of constant power, W (commanded).
  void step(double power) noexcept;

  /// Outputs at the end of the last step for the alpha of `weights`.
  Outputs outputs(const OutputWeights& weights) const noexcept;
  /// Sum over radial modes of peak_radial * beam * state, and of beam^2 * state; one per axial
  /// mode.
  const Eigen::VectorXd& axis_profile() const noexcept { return axis_profile_; }
  const Eigen::VectorXd& spot_profile() const noexcept { return spot_profile_; }

  /// Temperature rise per cell for these factors, radial x axial, K. Allocates.
  Eigen::MatrixXd temperatures(AbsorptionFactors at) const;

  const FullOrderModel& model() const noexcept { return *model_; }
  double period() const noexcept { return period_; }
  /// Modes that carry memory from one step to the next.
  std::size_t active_modes() const noexcept { return state_.size(); }

 private:
  void prepare();

  std::shared_ptr<const FullOrderModel> model_;
  Discretization discretization_;
  double period_;
  double negligible_decay_;
  double power_ = 0.0;                // of the last step: memoryless modes follow it
  std::vector<Eigen::Index> active_;  // per radial mode: the first so many axial modes have memory
  std::vector<double> state_;         // active modes, radial mode by radial mode
  std::vector<double> decay_;
  std::vector<double> gain_;
  Eigen::VectorXd axis_weight_;      // per radial mode: peak_radial * beam
  Eigen::VectorXd spot_weight_;      // per radial mode: beam^2
  Eigen::VectorXd axis_memoryless_;  // per axial mode and watt: share of the memoryless modes
  Eigen::VectorXd spot_memoryless_;
  Eigen::VectorXd axis_profile_;
  Eigen::VectorXd spot_profile_;
};

/// The simulated eye at full order, one alpha and beta: a ModalStepper if it is separable, else a
/// LayeredStepper. A Plant (loop/plant.hpp).
class FullOrderPlant {
 public:
  FullOrderPlant(std::shared_ptr<const FullOrderModel> model, Discretization discretization,
                 double period, AbsorptionFactors absorption, double negligible_decay = 1e-12)
      : stepper_(make(std::move(model), discretization, period, absorption, negligible_decay)) {}

  void set_period(double period) {
    std::visit([period](auto& stepper) { stepper.set_period(period); }, stepper_);
  }
  void step(double power) noexcept {
    if (auto* modal = std::get_if<Modal>(&stepper_)) {
      modal->stepper.step(power);
    } else {
      std::get_if<LayeredStepper>(&stepper_)->step(power);
    }
  }
  Outputs outputs() const noexcept {
    if (const auto* modal = std::get_if<Modal>(&stepper_))
      return modal->stepper.outputs(modal->weights);
    return std::get_if<LayeredStepper>(&stepper_)->outputs();
  }

 private:
  struct Modal {
    ModalStepper stepper;
    OutputWeights weights;
    void set_period(double period) { stepper.set_period(period); }
  };
  using Stepper = std::variant<Modal, LayeredStepper>;
  static Stepper make(std::shared_ptr<const FullOrderModel> model, Discretization discretization,
                      double period, AbsorptionFactors absorption, double negligible_decay) {
    if (!model->separable()) {
      return Stepper(std::in_place_type<LayeredStepper>, std::move(model), discretization, period,
                     absorption, negligible_decay);
    }
    OutputWeights weights = model->output_weights(absorption);
    return Stepper(
        Modal{{std::move(model), discretization, period, negligible_decay}, std::move(weights)});
  }

  Stepper stepper_;
};

}  // namespace photocoag
