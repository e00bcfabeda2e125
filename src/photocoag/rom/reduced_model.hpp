// Role: the interface between offline and online code; the parametric reduced model. Used by mor
// (makes it), estimation, mpc, loop. Source: paper, eq. (redmodel); docs/equations.md (E8) to
// (E11).
// Units: SI; u is the commanded power in W. Real time: evaluate() is noexcept, no allocation.
// Threads: plain data.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/outputs.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/rom/certificate.hpp"
#include "photocoag/rom/theta.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

using InputTerms = BoundedMatrix<kMaxOrder, kMaxTerms>;   // column j: B_j
using OutputTerms = BoundedMatrix<kMaxTerms, kMaxOrder>;  // row j: C_j

/// B(p), C_vol(p) and their derivatives at one p, the parameters.
struct ParametricMatrices {
  using Slopes = std::array<StateVector, kMaxParameters>;
  StateVector input;    ///< B_d(p), order
  Slopes input_slope;   ///< dB_d / dp_q; of the model's parameters only
  StateVector volume;   ///< C_vol(p), order
  Slopes volume_slope;  ///< dC_vol / dp_q
};

/// Range of one parameter over which the error of a reduced model was measured.
struct ParameterRange {
  double min = 1.0;
  double max = 1.0;

  /// Value `i` of `count` evenly spaced values from min to max; count >= 2.
  double at(int i, int count) const noexcept { return min + (max - min) * i / (count - 1); }
};

struct UncertainModel;

/// How well a reduced model follows the full-order model it was made from: largest error of an
/// output over the run relative to that output's largest value in the run, per alpha, the worse of
/// two signals.
struct ErrorReport {
  std::vector<double> absorption_factors;
  std::vector<double> choroid_factors;  ///< one per alpha for two parameters, else empty
  std::vector<double> peak;             ///< one per alpha
  std::vector<double> volume;           ///< one per alpha
  double duration = 0.0;                ///< s, of each signal: constant power, random on/off power
  double mean_dwell = 0.0;              ///< s, mean time between switchings of the on/off signal
  std::uint64_t seed = 0;               ///< of the on/off signal

  double peak_max() const noexcept;
  double volume_max() const noexcept;
};

/// x+ = A_d x + B_d(p) u,  y_vol = C_vol(p) x,  y_peak = C_peak x, with the parameters p.
///
/// Continuous time: A, B(p) = sum_j theta_j(p) B_j; C_vol(p) = sum_j theta_j(p) C_j, divided by the
/// absorbed fraction of the tissue if the volume temperature is the normalised one.
struct ReducedModel {
  StateMatrix A;         ///< 1/s, order x order, all eigenvalues negative
  InputTerms B;          ///< continuous-time B_j
  OutputTerms C_volume;  ///< C_j
  StateVector C_peak;    ///< as a column
  Theta theta;
  bool volume_normalized = false;
  AbsorbedFraction whole;  ///< absorbed fraction of the tissue, the normalisation's denominator

  double period = 0.0;  ///< s
  Discretization discretization = Discretization::kZeroOrderHold;
  StateMatrix A_d;  ///< discrete-time
  InputTerms B_d;   ///< discrete-time B_j

  /// Its parameters, in the order of ScaledBy: alpha, or alpha and beta.
  std::vector<ParameterRange> parameters = std::vector<ParameterRange>(1, {.min = 0.3, .max = 1.7});
  std::string method;                ///< e.g. "pod-deim"
  std::string refinement = "none";   ///< e.g. "output-error"
  std::string parameter_dependence;  ///< e.g. "deim"
  Tissue tissue;
  std::size_t full_order_states = 0;
  ErrorReport error;
  /// Proved bound of the error for this period; absent where none was computed.
  std::optional<ErrorCertificate> certificate;
  /// The responses over several uncertain quantities; null where none are declared.
  std::shared_ptr<const UncertainModel> uncertain;

  int order() const noexcept { return static_cast<int>(A.rows()); }
  int terms() const noexcept { return theta.terms; }

  /// All parametric discrete-time matrices with the derivatives by alpha, all other parameters 1.
  /// noexcept, no allocation.
  void evaluate(double alpha, ParametricMatrices& out) const noexcept;
  /// The same at all parameters, with the derivatives by each; a factor that is no parameter of
  /// this model is ignored and has the derivative zero.
  void evaluate(AbsorptionFactors at, ParametricMatrices& out) const noexcept;

  /// Fills A_d and B_d from A and B for `period` and `discretization`. Drops the certificate, which
  /// holds for one period only. Allocates.
  void discretize(double period_s, Discretization how);
};

/// The reduced model as a simulated eye, for one alpha and beta. A Plant (loop/plant.hpp).
class ReducedPlant {
 public:
  /// Uses the model's period and discretization. Keeps a copy.
  ReducedPlant(const ReducedModel& model, AbsorptionFactors absorption);

  /// Changes the period, s, keeping the state. Allocates.
  void set_period(double period);
  /// One period of constant power, W (commanded).
  void step(double power) noexcept;
  Outputs outputs() const noexcept;
  const StateVector& state() const noexcept { return state_; }

 private:
  ReducedModel model_;
  AbsorptionFactors absorption_;
  ParametricMatrices matrices_;
  StateVector state_;
};

/// What a model must satisfy before a controller may trust it. Throws Error naming the first
/// violation: sizes, finite entries, eigenvalues of A negative, discrete matrices that belong to
/// the continuous ones and have a spectral radius below 1, peak steady gain positive and increasing
/// in alpha, peak impulse response non-negative over the longest horizon (kMaxHorizon) in the range
/// of alpha, with two parameters for seven beta in that of beta.
void verify(const ReducedModel& model);

}  // namespace photocoag
