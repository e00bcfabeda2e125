// Role: setup and studies; special functions that the standard library lacks. Used by estimation.
// Real time: no.
#pragma once

namespace photocoag {

/// Q(a, x) = Gamma(a, x) / Gamma(a), the regularised upper incomplete gamma function; a, x > 0.
double upper_gamma(double a, double x);

}  // namespace photocoag
