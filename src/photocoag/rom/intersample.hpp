// Role: setup and simulation; reduced models between the ends of their periods: as the simulated
// eye of a bench, and as the model of a controller that knows when its samples are taken. Used by
// run, tests. Source: docs/equations.md (E29). Units: SI. Real time: step() is noexcept and does
// not allocate; everything else may.
#pragma once

#include <Eigen/Core>
#include <array>

#include "photocoag/core/intersample.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Mean over a window of the time in which a power acts: state * x + input * (B_d u), x the state
/// when it begins to act. Throws Error unless the model is exact for constant powers.
struct WindowMean {
  Eigen::MatrixXd state;
  Eigen::MatrixXd input;
};
WindowMean window_mean(const ReducedModel& model, Window window);

/// The model with twice the states: the second half is what the last sample saw of the first, and
/// the volume temperature is taken from it. Its first half is the state at the moment at which the
/// next power begins to act, power_lag after the period's end; so are its peak temperatures.
/// Throws Error if the order is above 7, the window begins before the period's power acts (the sum
/// of the three is above 1), or the model is not exact for constant powers.
ReducedModel with_intersample(const ReducedModel& model, const IntersampleTiming& timing);

/// What a controller that knows of `timing` gets: with_intersample(), or the model itself if there
/// is nothing to know.
ReducedModel told_of(const ReducedModel& model, const IntersampleTiming& timing);

/// IntersamplePlant (fom) at reduced order.
class ReducedIntersamplePlant {
 public:
  /// As IntersamplePlant. Throws Error unless the model is exact for constant powers.
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
