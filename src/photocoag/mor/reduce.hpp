// Role: offline; full-order model -> reduced model, with its measured error. Used by `reduce` and
// the model cache. Source: paper, section 2 (global basis and DEIM); docs/equations.md (E8) to
// (E13). Differences: exact zero-order hold by default; snapshot weights tuned here (the paper does
// not give its own). Units: SI.
#pragma once

#include <memory>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/progress.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/impulse_space.hpp"
#include "photocoag/mor/settings.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

inline constexpr int kCheckedChoroids = 7;  ///< values of beta at which the error is measured

/// How a reduced model's error is measured: constant and random on/off power from cold tissue.
struct ValidationSettings {
  std::vector<double>
      absorption_factors;         ///< empty: 29 values over [0.3, 1.7], none of them trained on;
                                  ///< with two parameters 15, each with seven beta
  double duration = 0.4;          ///< s
  double mean_dwell = 10e-3;      ///< s, mean time between switchings of the random power
  std::uint64_t seed = 20220101;  ///< of the random power; training uses no random signal
  /// Of a tissue with two parameters; empty: seven from 0.5 to 2.
  std::vector<double> choroid_factors = {};
};

/// Random on/off power (0 or 1 W) with exponentially distributed dwell times, whole periods.
std::vector<double> on_off_power(double duration, double period, double mean_dwell,
                                 std::uint64_t seed);

/// The full-order model's outputs for the validation powers and alphas: computed once, then any
/// number of reduced models of the same period and discretization is measured against it. The
/// full-order model is stepped once per signal if it is separable (its state does not depend on
/// alpha or beta), else once for each of a few sources that span all.
struct ValidationRun {
  std::vector<AbsorptionFactors> factors;
  bool two_parameters = false;
  double duration = 0.0;    ///< s
  double mean_dwell = 0.0;  ///< s, of the on/off power
  std::uint64_t seed = 0;
  std::vector<std::vector<double>> powers;    ///< W: constant, on/off
  std::vector<std::vector<Outputs>> outputs;  ///< per power: step by step, all factors in turn
};

ValidationRun validation_run(std::shared_ptr<const FullOrderModel> full,
                             Discretization discretization, double period,
                             const ValidationSettings& settings = {},
                             const Progress& progress = {});

ErrorReport measure_error(const ReducedModel& reduced, const ValidationRun& run);

/// Largest error of each output over the run relative to its own largest value, for each
/// alpha (and beta) the worse of both signals.
ErrorReport measure_error(const ReducedModel& reduced, std::shared_ptr<const FullOrderModel> full,
                          const ValidationSettings& settings = {}, const Progress& progress = {});

/// The impulse space that reduce() works in. Of `settings` only the range of beta counts.
ImpulseSpace reduction_space(const FullOrderModel& full, const ReductionSettings& settings = {});

/// The reduced model alone: neither verified nor measured nor certified. Throws Error if it is not
/// stable or the space has fewer directions than the order. `trial`, if not null, receives the
/// basis in the model's coordinates (mor/reconstruct.hpp).
ReducedModel project_model(const FullOrderModel& full, const ImpulseSpace& space,
                           const ReductionSettings& settings, double period,
                           Discretization discretization, Eigen::MatrixXd* trial = nullptr);

/// The reduced model of `full` for one control period, verified (rom/reduced_model.hpp), its error
/// measured and, where that can be done, certified (mor/certificate.hpp). Deterministic: the same
/// arguments give the same bits. Throws Error if the result cannot be trusted.
ReducedModel reduce(std::shared_ptr<const FullOrderModel> full, const ReductionSettings& settings,
                    double period, Discretization discretization, const Progress& progress = {});

}  // namespace photocoag
