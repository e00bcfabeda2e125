// Role: offline and online; thermal damage as an Arrhenius integral. Used by run (summary, report),
// safety.
// Source: docs/equations.md (E24); parameters as published, see each set. Not in the paper.
// Units: temperatures absolute in degrees Celsius at this boundary, K inside; dose dimensionless,
// damage at 1. Real time: add() is noexcept, no allocation.
#pragma once

#include <array>
#include <cmath>
#include <string_view>

namespace photocoag {

/// Omega = A * integral exp(-E_a / (R T)) dt.
struct ArrheniusParameters {
  std::string_view name;
  std::string_view end_point;    ///< what Omega = 1 stands for
  double log_frequency = 0.0;    ///< ln(A / (1/s)): A itself overflows single precision
  double activation_energy = 0;  ///< E_a, J/mol
};

/// Schlott et al. 2012 (J. Biomed. Opt.; the abstract prints J/mol, only kJ/mol fits its own
/// thresholds), and Welch and Polhamus as used by libArrhenius.
inline const std::array<ArrheniusParameters, 2> kPublishedDamage{{
    {"schlott_2012", "visible lesion after 1 h, rabbit", std::log(3e44), 273e3},
    {"welch_polhamus", "retinal damage", std::log(3.1e99), 6.28e5},
}};

/// Damage per second at an absolute temperature, 1/s. Zero at or below absolute zero.
inline double damage_rate(const ArrheniusParameters& tissue, double celsius) noexcept {
  constexpr double kGasConstant = 8.314462618;  // J/(mol K)
  const double kelvin = celsius + 273.15;
  if (!(kelvin > 0.0)) return 0.0;
  return std::exp(tissue.log_frequency - tissue.activation_energy / (kGasConstant * kelvin));
}

/// Damage during `duration`, s, while the temperature changes linearly between two values.
/// Simpson's rule: within 1 % for changes up to 3 K; larger ones only occur far below the
/// temperatures that count.
inline double damage_over(const ArrheniusParameters& tissue, double from_celsius, double to_celsius,
                          double duration) noexcept {
  const double middle = 0.5 * (from_celsius + to_celsius);
  return duration / 6.0 *
         (damage_rate(tissue, from_celsius) + 4.0 * damage_rate(tissue, middle) +
          damage_rate(tissue, to_celsius));
}

}  // namespace photocoag
