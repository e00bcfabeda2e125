// Role: setup; the eyes of the declared set and fast noise-free or noisy closed loops on them. Used
// by run/tissue_margin, population/spots. Source: derived here; docs/control.md (declared
// uncertainty). Units: SI. Difference to simulate_eye: the tissue's linear response is computed
// once per eye and the loop then convolves, no supervisor, the exact solver. Threads: immutable
// after construction.
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

/// One uncertain quantity: which part of the tissue it scales, and by how much at most.
struct DeclaredQuantity {
  std::string name;
  double less;  ///< relative, 0 to below 1
  double more;  ///< relative
  enum class Part { kSpotRadius, kThickness, kAbsorption, kChoroid } part;
  std::size_t layer = 0;
  bool declared = true;  ///< false: it does not move

  /// Relative change for a sign of -1, 0 or 1.
  double change(int sign) const noexcept { return sign < 0 ? -less : sign * more; }
  void scale(Tissue& tissue, double factor) const;
};

/// Spot radius, each thickness, each absorption that alpha does not scale, declared or not.
std::vector<DeclaredQuantity> tissue_quantities(const UncertaintySettings& uncertainty,
                                                const Tissue& tissue);

/// Those of the model's tissue as far as declared; and beta if it is estimated: from 1.6 deviations
/// below its initial value to 3.1 above, as alpha.
std::vector<DeclaredQuantity> declared_quantities(const Config& config);

/// The model's tissue with each quantity moved by change(signs[i]), signs -1, 0 or 1.
Tissue declared_tissue(const Config& config, const std::vector<DeclaredQuantity>& quantities,
                       const std::vector<int>& signs);

/// Noise for `count` treatments of `periods` periods each, a column per treatment, in deviations:
/// within each block of count - 1 periods every period has mean 0 and deviation 1 over the
/// treatments and no two are correlated. What is linear in the noise of one such block has then
/// its exact mean and deviation over the treatments, without the luck of a draw. `count`: 2 at
/// least. Always the same numbers. Allocates.
Eigen::MatrixXd balanced_noise(Eigen::Index periods, Eigen::Index count);

/// One tissue at full order and its response to one period of power.
class DeclaredEye {
 public:
  /// `cells`: grid; `periods`: as far as loops may run. Throws Error. Allocates.
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
