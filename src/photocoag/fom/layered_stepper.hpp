// Role: offline and simulated eye; time stepping of the full-order model where the layers conduct
// or store heat differently. Used by `response`, the full-order plant and the validation of reduced
// models through fom/stepper.hpp. Source: docs/equations.md (E7).
// Real time: step() is noexcept and does not allocate; everything else may.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/fom/rational_exponential.hpp"

namespace photocoag {

/// State of x' = A x + B u for one source, radial mode by depth cell. A = -S is block diagonal: a
/// symmetric tridiagonal S_i for each radial mode (FullOrderModel), so that a linear system costs
/// one pass down and one pass up in depth, prefactored, many radial modes at a time:
///   implicit Euler   (I + h S) x+ = x + h b u: one solve
///   TR-BDF2          two solves with one matrix (core/discretization.hpp)
///   zero-order hold  x+ = r(-hS) x + h (r(-hS) - 1)(-hS)^-1 b u with a rational r that differs
///                    from exp by 2.6e-12: six complex solves (fom/rational_exponential.hpp)
/// With zero-order hold most radial modes settle within one period: those whose slowest decay is
/// below `negligible_decay` are at their steady state S^-1 b u, summed up beforehand. Without power
/// modes only decay: those below negligible_decay of their value at power-off count as zero until
/// there is power again.
class LayeredStepper {
 public:
  /// The source of one alpha and beta. negligible_decay = 0 steps every mode.
  LayeredStepper(std::shared_ptr<const FullOrderModel> model, Discretization discretization,
                 double period, AbsorptionFactors absorption, double negligible_decay = 1e-12);
  /// Any source by its axial coordinates; the volume output has the same weight, not normalised.
  /// Throws Error if the model is separable.
  LayeredStepper(std::shared_ptr<const FullOrderModel> model, Discretization discretization,
                 double period, const Eigen::VectorXd& axial_source, double negligible_decay);

  /// Changes h, keeping the state. A new value needs a stepper that keeps every mode: throws Error.
  void set_period(double period);
  /// Cold tissue.
  void reset() noexcept;
  /// One period of constant power, W (commanded).
  void step(double power) noexcept;

  /// At the end of the last step.
  Outputs outputs() const noexcept { return outputs_; }
  /// Sum over radial modes of beam * state, one per depth cell: the volume output with any axial
  /// weight is its product with that weight. Allocates.
  Eigen::VectorXd spot_profile() const;
  /// Temperature rise per cell, radial x axial, K. Allocates.
  Eigen::MatrixXd temperatures() const;

  const FullOrderModel& model() const noexcept { return *model_; }
  double period() const noexcept { return period_; }
  /// Radial modes times depth cells that carry memory from one step to the next.
  std::size_t active_modes() const noexcept { return state_.size(); }

 private:
  // Radial modes are processed in blocks of this many: enough to hide instruction latency, few
  // enough to stay in the cache. Measured: 32 takes half the time of 8. Arrays: block, then depth
  // cell, then radial mode of the block.
  static constexpr Eigen::Index kLanes = 32;
  struct ComplexFactor {
    std::vector<double> real;  // 1 / pivot
    std::vector<double> imag;
  };

  void prepare();
  void factorize_real(double constant, double scale, Eigen::Index first_block, Eigen::Index blocks,
                      std::vector<double>& inverse_pivot) const;
  void factorize_complex(int pair);
  void add_steady_modes();
  void plan_sleep();
  void step_implicit_euler(double power) noexcept;
  void step_tr_bdf2(double power) noexcept;
  void step_zero_order_hold(double power) noexcept;
  void add_outputs(Eigen::Index block) noexcept;
  void put_to_sleep() noexcept;
  // Coordinates of mode i, cell j.
  double coordinate(Eigen::Index i, Eigen::Index j) const noexcept;

  std::shared_ptr<const FullOrderModel> model_;
  Discretization discretization_;
  double period_;
  double negligible_decay_;
  double volume_norm_ = 1.0;
  double power_ = 0.0;  // of the last step: modes without memory follow it
  bool cold_ = true;    // the state is zero
  Outputs outputs_;
  Outputs steady_gain_;  // per watt: share of the modes without memory

  Eigen::Index cells_ = 0;          // in depth
  Eigen::Index blocks_ = 0;         // of radial modes
  Eigen::Index active_blocks_ = 0;  // with memory
  Eigen::Index awake_ = 0;          // of these: not negligible
  std::size_t dark_steps_ = 0;      // without power
  std::vector<double> awake_for_;   // per active block: so many of them
  Eigen::VectorXd source_;          // per depth cell: heating per watt, input gain included
  Eigen::VectorXd volume_weight_;   // per depth cell
  Eigen::VectorXd peak_weight_;     // per depth cell
  Eigen::Index volume_first_ = 0;   // outside [first, last) the weight is 0
  Eigen::Index volume_last_ = 0;
  Eigen::Index peak_first_ = 0;
  Eigen::Index peak_last_ = 0;
  Eigen::VectorXd rates_;        // per radial mode, padded to whole blocks
  Eigen::VectorXd beam_;         // padded with 0
  Eigen::VectorXd peak_radial_;  // padded with 0
  Eigen::VectorXd coupling_;     // off-diagonal of the scaled matrix: one per pair of cells
  std::vector<double> state_;    // active blocks
  std::vector<double> steady_;   // the others, per watt
  std::vector<double> inverse_pivot_;
  std::array<ComplexFactor, RationalExponential::kPairs> complex_;
  std::vector<double> scratch_;  // one block each
  std::vector<double> scratch_imag_;
  std::vector<double> sum_;
};

}  // namespace photocoag
