// Role: setup; how far reference and limit must be backed off so that tissue which differs from the
// model as declared in [uncertainty], or a model whose error the certificate does not cover in the
// filter, stays below the limit. Used by the program before a treatment, by studies, campaigns and
// replays. Source: derived here; docs/control.md (declared uncertainty). Units: SI.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct TissueMargin {
  /// The largest of the shares, at most 1: reference and limit are multiplied by it.
  double factor = 1.0;
  /// What is multiplied besides at the end of period 1, 2, …, the last one ever after; at most 1.
  std::vector<double> shares;
  double peak_unprotected = 0.0;  ///< K, of the worst eye with the configured limit
  double peak_protected = 0.0;    ///< K, of the worst eye after backing off
  std::string worst;              ///< which eye: "spot radius -10 %, …, alpha 1.1, period 1"
  std::size_t eyes = 0;           ///< tissues times alphas that were treated

  bool needed() const noexcept { return factor < 1.0 || !shares.empty(); }
};

/// What a margin is searched for: declared uncertainty, or control.robust = "certified".
bool wants_margin(const Config& config) noexcept;

/// Closed loops (run/declared_eye.hpp) on all corners of the declared set at all alphas of a grid
/// from 1.6 deviations below the estimator's initial alpha to 3.1 above, with noise: of each eye
/// mean and deviation of the peak over the noise are computed period by period, and the mean plus
/// robust_sigma deviations is kept below the limit. Each stretch of time since the start has a
/// share of reference and limit, which is lowered until no eye exceeds the limit in it; eyes that
/// come near are treated at a finer grid of alphas and with more noise. The first 1,000 periods are
/// searched; later ones have the last share. Takes up to minutes. Throws Error if a share below a
/// half were needed. Allocates.
TissueMargin tissue_margin(const Config& config, const ReducedModel& model);

/// `config` with reference, references and limit multiplied by the factor, and the shares.
Config backed_off(const Config& config, const TissueMargin& margin);

/// What the controller is told: backed off if a margin is wanted, else `config`.
Config told_to_controller(const Config& config, const ReducedModel& model);

}  // namespace photocoag
