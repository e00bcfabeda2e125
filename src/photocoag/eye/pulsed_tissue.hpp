// Role: simulation; the full-order model heated pulse by pulse, and the photoacoustic signal of a
// pulse. Used by the simulated eye. Source: docs/photoacoustics.md (P7), (P8); docs/equations.md
// (E7). Units: SI; rises over ambient. Real time: pulse and signal are noexcept and do not
// allocate.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "photocoag/core/outputs.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/photoacoustics/curve.hpp"

namespace photocoag {

/// State as in ModalStepper (per mode and per unit of the mode's source). A pulse of energy E adds
/// E to every mode instantly (no conduction during the pulse), then a mode of rate l decays over
/// the pulse period h: s+ = exp(-l h) (s + E), exactly. Modes that decay to 1e-6 within one period
/// have no state. Needs a separable model.
class PulsedTissue {
 public:
  /// Throws Error if layers conduct differently.
  PulsedTissue(std::shared_ptr<const FullOrderModel> model, double pulse_period,
               AbsorptionFactors absorption, const GrueneisenCurve& curve);

  void reset() noexcept;  ///< cold
  /// One pulse of `energy`, J (commanded), and the pulse period after it.
  void pulse(double energy) noexcept;

  /// Just before the next pulse. Volume: the normalised mean.
  Outputs before() const noexcept { return before_; }
  /// Means over the last pulse period, as with a laser of constant power.
  Outputs mean() const noexcept { return mean_; }
  /// Right after the last pulse, K.
  double peak_after() const noexcept { return peak_after_; }
  /// Gamma just before the next pulse, weighted over depth and beam: (P8). Once per pulse.
  double signal() noexcept;
  std::size_t states() const noexcept { return model_->states(); }

 private:
  static constexpr Eigen::Index kRings = 6;  // groups of radial cells of equal beam power
  static constexpr Eigen::Index kRingsPerPulse = 2;
  static constexpr Eigen::Index kDepths = 16;  // groups of axial cells of equal absorption
  void prepare_modes(double pulse_period);
  void prepare_curved(AbsorptionFactors absorption);

  std::shared_ptr<const FullOrderModel> model_;
  GrueneisenCurve curve_;
  double ambient_;
  Eigen::VectorXd peak_weight_;    // per axial mode
  Eigen::VectorXd volume_weight_;  // per axial mode, normalised
  Eigen::VectorXd axis_weight_;    // per radial mode
  Eigen::VectorXd spot_weight_;
  std::vector<Eigen::Index> active_;  // per radial mode: the first so many axial modes
  std::vector<double> state_;
  std::vector<double> decay_;
  std::vector<double> share_;  // (1 - exp(-l h)) / (l h): mean over the period / start
  double peak_gain_ = 0.0;     // K/J at once
  Outputs memoryless_mean_;    // K/J, of the modes without state
  Eigen::VectorXd axis_;       // profiles, per axial mode
  Eigen::VectorXd spot_;
  Eigen::VectorXd axis_mean_;
  Eigen::VectorXd spot_mean_;
  Outputs before_;
  Outputs mean_;
  double peak_after_ = 0.0;
  // For a curve that is not a line: mean temperatures of rings x depths.
  std::vector<Eigen::Index> felt_;  // per radial mode: the first so many axial modes matter
  Eigen::MatrixXd ring_weight_;     // rings x radial modes
  Eigen::MatrixXd depth_weight_;    // axial modes that are felt x depths
  Eigen::Index next_ring_ = 0;
  Eigen::MatrixXd ring_profile_;                    // axial modes x rings of one pulse
  Eigen::Vector<double, kRings> ring_temperature_;  // K, means
  Eigen::Vector<double, kRings> ring_curve_;        // of the curve's values
  Eigen::VectorXd ring_share_;
  Eigen::VectorXd depth_share_;
};

}  // namespace photocoag
