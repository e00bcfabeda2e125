// Role: offline; B(alpha) and C_vol(alpha) as sums of terms. Used by mor. Source: docs/models.md
// (parameter dependence); paper, section 2 for DEIM. One function serves both because the volume
// output is the input's adjoint: both are the same axial source vector. Units: SI.
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

/// The range of beta to make a model for; beta = 1 if the tissue has one parameter.
struct ChoroidRange {
  bool free = false;  ///< two parameters
  double low = 1.0;
  double high = 1.0;

  /// `count` values from low / margin to high * margin with equal ratios; {1} if not free.
  std::vector<double> samples(int count, double margin) const;
};

/// The settings' range if a layer of the tissue is scaled by beta, else beta = 1.
ChoroidRange choroid_range(const Tissue& tissue, const ReductionSettings& settings);

/// Every alpha with every beta, alpha running fastest.
std::vector<AbsorptionFactors> tensor(const std::vector<double>& alphas,
                                      const std::vector<double>& betas);

/// Interpolation over alpha in [0.2, 2], the estimator's widest range, and beta in `choroid`
/// widened by a factor of 1.25 at both ends; or the Taylor polynomial. DEIM may return fewer terms
/// than asked for (deim.hpp). Throws Error if the dependence has one parameter (kTaylor) and the
/// tissue two. Allocates.
ParametricSource parametric_source(const FullOrderModel& full, ParameterDependence dependence,
                                   int terms, const ChoroidRange& choroid = {});

/// theta at alpha and beta. Allocates.
Eigen::VectorXd theta_at(const Theta& theta, AbsorptionFactors at);

/// `count` values from first to last with equal ratios.
std::vector<double> log_spaced(double first, double last, int count);

}  // namespace photocoag
