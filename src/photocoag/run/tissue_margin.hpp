// Role: setup; how far reference and limit must be backed off so that tissue which differs from the
// model as declared in [uncertainty] stays below the limit. Used by the program before a
// treatment. Source: derived here; docs/control.md (declared uncertainty). Units: SI.
#pragma once

#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct TissueMargin {
  double factor = 1.0;            ///< reference and limit are multiplied by it; at most 1
  double peak_unprotected = 0.0;  ///< K, of the worst tissue with the configured limit
  double peak_protected = 0.0;    ///< K, of the worst tissue after backing off
  std::string worst;              ///< which tissue: "spot radius -10 %, …, alpha 1.1"
};

/// Noise-free closed loops on full-order eyes (a coarser grid: 20,000 cells). Each declared
/// quantity is moved up and down by itself, at the initial estimate of alpha; the directions that
/// raise the peak are then combined into one tissue, and reference and limit are scaled until its
/// highest peak, with robust_sigma standard deviations of the estimated peak on top, keeps the
/// configured limit for three alphas (initial - 1.5, 0 and + 3 standard deviations). Takes about a
/// second. Throws Error if no factor from 0.5 on suffices. Allocates.
TissueMargin tissue_margin(const Config& config, const ReducedModel& model);

/// `config` with reference, references and limit multiplied by the factor.
Config backed_off(const Config& config, const TissueMargin& margin);

}  // namespace photocoag
