// Role: offline; modes of the full-order model at the sample instants after one period of 1 W, for
// every alpha and beta at once. Used by the certificate. Source: docs/equations.md (E7);
// docs/models.md. Why not ModalStepper: without later power every mode only decays, so modes drop
// out for good and ten thousand periods cost little more than the first hundred. Units: SI.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/types.hpp"

namespace photocoag {

/// Sums over the radial modes, one per axial mode; as ModalStepper's profiles.
struct AxialProfiles {
  Eigen::VectorXd axis;            ///< sum_i peak_i beam_i x_ij
  Eigen::VectorXd axis_magnitude;  ///< sum_i |peak_i beam_i| x_ij
  Eigen::VectorXd spot;            ///< sum_i beam_i^2 x_ij
};

/// Radial modes that share their axial modes.
struct ModeGroup {
  Eigen::MatrixXd rates;        ///< 1/s, axial x radial modes, ascending in both
  Eigen::VectorXd axis_weight;  ///< peak_i beam_i
  Eigen::VectorXd spot_weight;  ///< beam_i^2
};

/// Decay factor of a mode per period, for zero-order hold and implicit Euler.
double mode_decay(double rate, Discretization discretization, double period) noexcept;

class PulseResponse {
 public:
  /// At k = 1, the end of the period with power. Allocates.
  PulseResponse(const ModeGroup& group, Discretization discretization, double period);

  /// k <- k + 1. A mode that has decayed below 1e-20 of its first value is dropped.
  void advance() noexcept;

  /// x_ij = gain_ij decay_ij^(k-1).
  const AxialProfiles& profiles() const noexcept { return profiles_; }
  /// Number of axial modes that are not yet dropped; they come first.
  Eigen::Index active() const noexcept { return active_.empty() ? 0 : active_.front(); }

  /// Sums over all k > `after`: x_ij = decay_ij^after / rate_ij for both discretizations; after = 0
  /// is the steady state for 1 W. Allocates.
  AxialProfiles sum_after(double after) const;

 private:
  AxialProfiles zero_profiles() const;
  void collect() noexcept;

  ModeGroup group_;
  Discretization discretization_;
  double period_;
  Eigen::MatrixXd decay_;  // axial x radial modes
  Eigen::MatrixXd state_;
  Eigen::MatrixXd least_;             // below it a mode is dropped
  std::vector<Eigen::Index> active_;  // per radial mode: axial modes still there
  AxialProfiles profiles_;
};

}  // namespace photocoag
