// Role: setup; the eyes of the declared set, and fast closed loops on them with or without noise.
// Used by run/tissue_margin, population/spots. Source: derived here; docs/control.md (declared
// uncertainty). Units: SI. Differences to simulate_eye: the tissue's impulse response is computed
// once per eye and then convolved; no supervisor; always the exact solver. Threads: immutable after
// construction.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// One uncertain quantity: the part of the tissue that it scales, and its range.
struct DeclaredQuantity {
  std::string name;
  double less;  ///< relative decrease, 0 to below 1
  double more;  ///< relative increase
  enum class Part { kSpotRadius, kThickness, kAbsorption, kChoroid } part;
  std::size_t layer = 0;
  bool declared = true;  ///< false: it stays fixed

  /// Relative change for a sign of -1, 0 or 1.
  double change(int sign) const noexcept { return sign < 0 ? -less : sign * more; }
  void scale(Tissue& tissue, double factor) const;
};

/// Spot radius, each thickness, each absorption that alpha does not scale, declared or not.
std::vector<DeclaredQuantity> tissue_quantities(const UncertaintySettings& uncertainty,
                                                const Tissue& tissue);

/// The declared quantities of the model's tissue, and beta if it is estimated: from 1.6 deviations
/// below its initial value to 3.1 above, as for alpha.
std::vector<DeclaredQuantity> declared_quantities(const Config& config);

/// The model's tissue with each quantity moved by change(signs[i]), signs -1, 0 or 1.
Tissue declared_tissue(const Config& config, const std::vector<DeclaredQuantity>& quantities,
                       const std::vector<int>& signs);

/// Noise for `count` treatments of `periods` periods each, a column per treatment, in deviations:
/// within each block of count - 1 periods every period has mean 0 and deviation 1 over the
/// treatments and no two are correlated. Quantities linear in the noise of one block then have
/// their exact mean and deviation over the treatments, without sampling error. `count`: at least 2.
/// Deterministic. Allocates.
Eigen::MatrixXd balanced_noise(Eigen::Index periods, Eigen::Index count);

/// One tissue at full order and its response to one period of power.
class DeclaredEye {
 public:
  /// `cells`: of the grid; `periods`: longest treatment. Throws Error. Allocates.
  DeclaredEye(const Config& config, const Tissue& tissue, std::size_t cells, std::size_t periods);

  /// Treatments by config.control and config.estimator, one per column of `noise` (K, a row per
  /// period, at most as many as `periods`): the true peak at the end of each period, K. Throws
  /// Error on bad settings. Allocates.
  Eigen::MatrixXd treat(const Config& config, const ReducedModel& model, double alpha,
                        const Eigen::MatrixXd& noise) const;

 private:
  Config config_;  // of plant, period
  std::shared_ptr<const FullOrderModel> full_;
  Eigen::Index periods_;
  // Separable: a row per period, a column per axial mode; they serve every alpha.
  Eigen::MatrixXd axis_;
  Eigen::MatrixXd spot_;
};

}  // namespace photocoag
