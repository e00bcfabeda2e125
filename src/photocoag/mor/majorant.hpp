// Role: offline; a short sum of exponentials that bounds a sequence from above. Used by the
// certificate.
// Source: linear programming by the dual simplex tableau (Dantzig 1963, ch. 6); docs/models.md.
#pragma once

#include <vector>

namespace photocoag {

/// c_j >= 0 with sum_j c_j decay_j^(k-1) >= value_k for k = 1 … n (value[0] is k = 1), and
/// c_0 decay_0^n >= last: so that the first exponential alone bounds the tail beyond n.
/// Close to the minimum of sum_j c_j / (1 - decay_j). `decay` in [0, 1), decay[0] the slowest and
/// above 0; values not negative. Throws Error if there is no such majorant.
std::vector<double> exponential_majorant(const std::vector<double>& value,
                                         const std::vector<double>& decay, double last);

/// sum_j c_j decay_j^(k-1), k >= 1.
double majorant_value(const std::vector<double>& c, const std::vector<double>& decay, double k);

}  // namespace photocoag
