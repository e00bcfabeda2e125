// Role: offline; fits a reduced model's rates, inputs and peak weights to the full-order model's
// responses. Used by mor. Source: output-error least squares by Levenberg and Marquardt (Nocedal
// and Wright 2006, section 10.3); docs/models.md (refinement).
// Difference to a projection: rates, inputs and peak weights are free; the structure that
// guarantees stability and passivity is kept: A diagonal and negative, C_vol = B' / gain. Units:
// SI.
#pragma once

#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/impulse_space.hpp"
#include "photocoag/mor/parameter_dependence.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Minimises over (rates, B_j, C_peak) the weighted squares of the differences between the pulse
/// responses of both outputs, at eight alphas (with two parameters at each of `betas`) and at the
/// ends of periods up to 6 s:
///   sum_a sum_k w_k^2 [ (h_peak,k - h_peak,k^r)^2 / gain_peak^2 + the same for the volume ]
/// `model` must be a Galerkin model with `source`'s theta (A diagonal, C_vol = B' / gain); the
/// search starts there and never makes it worse. Returns half the sum, to compare starting points
/// by. Changes A, B, C_volume and C_peak. Periods in s. Allocates. Deterministic.
double refine(const FullOrderModel& full, const ImpulseSpace& space, const ParametricSource& source,
              double period, Discretization how, ReducedModel& model,
              const std::vector<double>& betas = {1.0});

/// Largest error of the peak or the volume output relative to that output's largest value, under
/// constant power and square waves of three dwell times over 0.4 s, at alphas (with two parameters
/// at each of `betas`) that are neither trained on nor those of measure_error(): what a refined
/// model and its projection are compared by. Allocates.
double response_error(const FullOrderModel& full, const ImpulseSpace& space, double period,
                      Discretization how, const ReducedModel& model,
                      const std::vector<double>& betas = {1.0});

/// V, impulse-space size x order, with impulse-space state ~ V * reduced state, for a model that is
/// no projection: least squares over the same responses, the state's error in the energy norm.
/// Allocates.
Eigen::MatrixXd fitted_trial(const FullOrderModel& full, const ImpulseSpace& space, double period,
                             Discretization how, const ReducedModel& model,
                             const std::vector<double>& betas = {1.0});

}  // namespace photocoag
