// Role: offline; B(alpha) and C_vol(alpha) as sums of terms. Used by mor. Source: docs/models.md
// (parameter dependence); paper, section 2 for DEIM. Why one function serves both: the volume
// output is the input's adjoint, both are the same axial source vector. Units: SI.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/settings.hpp"
#include "photocoag/rom/theta.hpp"

namespace photocoag {

inline constexpr double kTaylorCenter = 0.7363;  ///< the paper's mean alpha

/// axial_source(alpha) ~ sources * theta(alpha).
struct ParametricSource {
  Theta theta;
  Eigen::MatrixXd sources;  ///< axial modes x terms
};

/// Interpolation over [0.2, 2], the estimator's widest range, or the Taylor polynomial. DEIM may
/// return fewer terms than asked for (deim.hpp). Allocates.
ParametricSource parametric_source(const FullOrderModel& full, ParameterDependence dependence,
                                   int terms);

/// `count` values from first to last with equal ratios.
std::vector<double> log_spaced(double first, double last, int count);

}  // namespace photocoag
