// Role: setup; the estimator's tuning, in physical units only. Used by estimation and
// configuration.
#pragma once

#include <vector>

#include "photocoag/core/intersample.hpp"
#include "photocoag/rom/belief.hpp"

namespace photocoag {

struct Field;  // core/setting.hpp

enum class EstimatorKind {
  kEkf,        ///< extended Kalman filter
  kMhe,        ///< moving horizon estimator
  kPosterior,  ///< posterior of all of the prior's quantities given all samples; needs a prior
};

enum class Unknowns {
  kRpe,            ///< alpha
  kRpeAndChoroid,  ///< alpha and beta; needs a model with both
};

inline constexpr int kMaxWindow = 50;  // samples of the moving horizon

struct EstimatorSettings {
  EstimatorKind kind = EstimatorKind::kEkf;
  double absorption_initial = 0.7363;      ///< 1, alpha before the first sample; mean of porcine
                                           ///< eyes (paper); inside [min, max]
  double absorption_sigma_initial = 0.25;  ///< 1, its standard deviation, above 0, at most 2
  double absorption_min = 0.2;             ///< 1, alpha is kept inside [min, max]; from 0.05
  double absorption_max = 2.0;             ///< 1, up to 5
  double absorption_process_noise = 1e-5;  ///< 1, standard deviation added to alpha per control
                                           ///< sample (variance: its square); from 0 to 0.1
  double power_process_noise =
      4e-4;  ///< W, standard deviation per control sample of an unknown power that enters as the
             ///< laser does; represents the model's error, tuned so that peak_sigma is consistent
             ///< with the peak's error (docs/estimation.md); from 0 to 0.01
  double measurement_noise = 0.288;  ///< K, standard deviation of the volume temperature per
                                     ///< control sample (paper); above 0, at most 20
  double outlier_sigma =
      6.0;  ///< 1, a sample is rejected if its innovation exceeds this many standard deviations
            ///< (outlier_gate.hpp); 0: never; else from 3 to 100
  int window = 20;  ///< 1, control samples in the moving horizon, 2 to 50
  Unknowns unknowns = Unknowns::kRpe;
  double choroid_initial = 1.0;         ///< 1, beta before the first sample; inside [min, max];
                                        ///< its constant value where it is not estimated
  double choroid_sigma_initial = 0.3;   ///< 1, its standard deviation, above 0, at most 2
  double choroid_min = 0.4;             ///< 1, beta is kept inside [min, max]; from 0.05
  double choroid_max = 2.5;             ///< 1, up to 20
  double choroid_process_noise = 1e-5;  ///< 1, as absorption_process_noise; from 0 to 0.1

  /// Known timing of samples and power, fractions of a period, at most 1 in sum; built into the
  /// model of estimator and controller (rom/intersample.hpp).
  IntersampleTiming timing = {};

  /// For kPosterior: the prior. No key: made from [[prior]].
  Belief prior = {};

  int unknown_count() const noexcept { return unknowns == Unknowns::kRpe ? 1 : 2; }

  /// Throws Error naming the key ("estimator.…"), the value and the range.
  void validate() const;
  bool operator==(const EstimatorSettings&) const = default;
};

/// The keys "estimator.…", bound to `settings`.
std::vector<Field> fields_of(EstimatorSettings& settings);

}  // namespace photocoag
