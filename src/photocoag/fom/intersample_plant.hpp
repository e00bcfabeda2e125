// Role: simulation; the full-order eye with delayed or averaged samples, delayed power or drifting
// absorption. Used by run, fmu, fault_table. Source: docs/equations.md (E29).
// Difference to FullOrderPlant: outputs between the ends of the periods and a source that changes,
// both exact and in one step per period. Units: SI. Real time: step() is noexcept and does not
// allocate.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "photocoag/core/intersample.hpp"
#include "photocoag/fom/full_order_model.hpp"

namespace photocoag {

/// Each power acts for one period, zero-order hold, and the modes are stepped from one power's
/// onset to the next. With mode rate l, state x at the onset and heat q from then on, everything in
/// between is exact:
///   x(t) = exp(-l t) x + (1 - exp(-l t)) / l q,  and its means over a window likewise.
/// The absorption factor is constant within a period; heat stays where it was absorbed.
class IntersamplePlant {
 public:
  /// `drift`: of alpha, 1/s (drifted_absorption). Throws Error if the model is not separable.
  IntersamplePlant(std::shared_ptr<const FullOrderModel> model, double period,
                   AbsorptionFactors absorption, const IntersampleTiming& timing, double drift,
                   double negligible_decay = 1e-12);

  void step(double power) noexcept;
  /// At the end of the period.
  Outputs outputs() const noexcept { return outputs_; }
  /// Sampled volume temperature, K, before noise and gain.
  double sample() const noexcept { return sample_; }
  /// The true alpha of the last period.
  double absorption_factor() const noexcept { return absorption_.alpha; }

 private:
  // A mean over a window of the time in which one power acts, summed over the radial modes.
  struct View {
    Window window;
    Eigen::VectorXd radial_weight;
    std::vector<double> decay;  // active modes: weight included
    Eigen::VectorXd before;     // per axial mode: modes without memory, of the heat before
    Eigen::VectorXd rise;       // per axial mode: all modes, of the heat now
    Eigen::VectorXd profile;    // per axial mode
  };
  View make_view(Window window, const Eigen::VectorXd& radial_weight) const;
  void look(View& view) noexcept;
  void set_source() noexcept;
  double volume(const View& view) const noexcept;

  std::shared_ptr<const FullOrderModel> model_;
  double period_;
  AbsorptionFactors absorption_;
  AbsorptionFactors first_;
  double drift_;
  long long periods_ = 0;
  SampleWindows windows_;
  std::vector<Eigen::Index> active_;  // per radial mode: the first so many axial modes have memory
  std::vector<double> state_;
  std::vector<double> decay_;
  std::vector<double> gain_;
  std::array<View, SampleWindows::kMost> samples_;
  View volume_;  // at the end of the period
  View peak_;
  Eigen::VectorXd absorbed_;  // per cell, over root_measure
  Eigen::VectorXd source_;    // per axial mode
  Eigen::VectorXd heat_;
  Eigen::VectorXd heat_before_;
  double norm_ = 1.0;
  std::array<double, SampleWindows::kMost> seen_{};       // of the power that acts now
  std::array<double, SampleWindows::kMost> seen_once_{};  // of the one before
  double seen_twice_ = 0.0;
  Outputs outputs_;
  double sample_ = 0.0;
};

}  // namespace photocoag
