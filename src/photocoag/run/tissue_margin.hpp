// Role: setup; how far reference and limit must be backed off so that the peak stays below the
// limit although the tissue differs from the model as declared in [uncertainty], or the filter is
// subject to model error that the certificate does not cover. Used by apps, study, campaign,
// session, fmu, run/replay, python. Source: derived here; docs/control.md (declared uncertainty).
// Units: SI.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct TissueMargin {
  /// Common factor of reference and limit, at most 1: the largest of all shares.
  double factor = 1.0;
  /// Further factors at the end of period 1, 2, …, the last one from then on; at most 1.
  std::vector<double> shares;
  double peak_unprotected = 0.0;  ///< K, of the worst eye with the configured limit
  double peak_protected = 0.0;    ///< K, of the worst eye after backing off
  std::string worst;              ///< which eye: "spot radius -10 %, …, alpha 1.1, period 1"
  std::size_t eyes = 0;           ///< eyes treated: tissues times alphas

  bool needed() const noexcept { return factor < 1.0 || !shares.empty(); }
};

/// True with declared uncertainty or control.robust = "certified".
bool wants_margin(const Config& config) noexcept;

/// Closed loops (run/declared_eye.hpp) on all corners of the declared set at all alphas of a grid
/// from 1.6 deviations below the estimator's initial alpha to 3.1 above, with noise: for each eye
/// the peak's mean and deviation over the noise are computed period by period, and the mean plus
/// robust_sigma deviations is kept below the limit. Each time interval since the start has a share
/// of reference and limit, which is lowered until no eye exceeds the limit in it; eyes near the
/// limit are treated again on a finer grid of alphas and with more noise. The first 1,000 periods
/// are searched; later ones have the last share. May take minutes. Throws Error if a share below
/// one half would be needed. Allocates.
TissueMargin tissue_margin(const Config& config, const ReducedModel& model);

/// `config` with references and limit multiplied by the factor, and with the shares.
Config backed_off(const Config& config, const TissueMargin& margin);

/// The controller's configuration: backed off if a margin is wanted, else `config`.
Config controller_config(const Config& config, const ReducedModel& model);

}  // namespace photocoag
