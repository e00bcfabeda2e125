// Role: offline; the proved error bound of a reduced model. Used by `reduce`. Source: derived here;
// docs/models.md (certificate) has the proof and what it leaves to rounding. Units: SI.
#pragma once

#include <string_view>

#include "photocoag/core/discretization.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct CertificateSettings {
  double treatment = 0.4;            ///< s; a second bound holds for powers of this duration
  int nodes = 57;                    ///< of alpha, over the model's range; at least 2
  int nodes_beside_beta = 29;        ///< the same for two parameters
  int choroid_nodes = 13;            ///< of beta, over the model's range; at least 2
  std::size_t max_horizon = 60'000;  ///< periods summed explicitly
  double remaining = 1e-6;  ///< the horizon ends where the slowest mode has decayed to this
};

/// Why there is no certificate for this time scheme; empty where certify() works: zero-order hold
/// and implicit Euler.
std::string_view why_uncertified(Discretization discretization) noexcept;

/// The certificate of `reduced` (its period, discretization and ranges of alpha and beta) against
/// all modes of `full`; for two parameters every bound is the largest over beta. Throws Error if
/// why_uncertified() has a reason or the reduced transition matrix has ill-conditioned
/// eigenvectors. Allocates 16 bytes x nodes of alpha x horizon, and what FullImpulse keeps.
ErrorCertificate certify(const ReducedModel& reduced, const FullOrderModel& full,
                         const CertificateSettings& settings = {});

}  // namespace photocoag
