// Role: setup and simulation; reduced models with intersample timing: as a simulated eye, and as
// the model of a controller that knows when its samples are taken. Used by run, study, fmu, export,
// python. Source: docs/equations.md (E29). Units: SI. Real time: step() is noexcept and does not
// allocate; everything else may.
#pragma once

#include <Eigen/Core>
#include <array>

#include "photocoag/core/intersample.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Mean over a window of the time in which a power acts: state * x + input * (B_d u), x the state
/// when it begins to act. Throws Error unless the model's discretization is zero-order hold.
struct WindowMean {
  Eigen::MatrixXd state;
  Eigen::MatrixXd input;
};
WindowMean window_mean(const ReducedModel& model, Window window);

/// The model with twice the states: the second half is the first half as the last sample saw it,
/// and gives the volume temperature. The first half is the state when the next power begins to act,
/// power_lag after the period's end; the peak temperature is that of the same instant. Throws Error
/// if the order is above 7, the window begins before the period's power acts (the sum of the three
/// is above 1), or the discretization is not zero-order hold.
ReducedModel with_intersample(const ReducedModel& model, const IntersampleTiming& timing);

/// The model of a controller that accounts for `timing`: with_intersample(), or `model` itself if
/// the timing is plain.
ReducedModel controller_model(const ReducedModel& model, const IntersampleTiming& timing);

/// IntersamplePlant (fom) at reduced order.
class ReducedIntersamplePlant {
 public:
  /// As IntersamplePlant. Throws Error unless the model's discretization is zero-order hold.
  ReducedIntersamplePlant(const ReducedModel& model, AbsorptionFactors absorption,
                          const IntersampleTiming& timing, double drift);

  void step(double power) noexcept;
  Outputs outputs() const noexcept { return outputs_; }
  double sample() const noexcept { return sample_; }
  double absorption_factor() const noexcept { return absorption_.alpha; }

 private:
  struct View {
    StateMatrix state;
    StateMatrix input;
  };
  View make_view(Window window) const;
  StateVector look(const View& view, const StateVector& heat) const noexcept;

  ReducedModel model_;
  AbsorptionFactors absorption_;
  AbsorptionFactors first_;
  double drift_;
  long long periods_ = 0;
  SampleWindows windows_;
  std::array<View, SampleWindows::kMost> samples_;
  View end_;
  ParametricMatrices matrices_;
  StateVector state_;
  std::array<double, SampleWindows::kMost> seen_{};
  std::array<double, SampleWindows::kMost> seen_once_{};
  double seen_twice_ = 0.0;
  Outputs outputs_;
  double sample_ = 0.0;
};

}  // namespace photocoag
