// Role: offline; the proved error bound of a reduced model. Used by `reduce`. Source: derived here;
// docs/models.md (certificate) has every step, what is proved and what is rounding. Units: SI.
#pragma once

#include <string_view>

#include "photocoag/core/discretization.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct CertificateSettings {
  double treatment = 0.4;            ///< s; a second bound is for powers of this duration
  int nodes = 57;                    ///< of alpha, over the model's range; at least 2
  int nodes_beside_beta = 29;        ///< the same for two parameters
  int choroid_nodes = 13;            ///< of beta, over the model's range; at least 2
  std::size_t max_horizon = 60'000;  ///< periods summed one by one
  double remaining = 1e-6;           ///< the slowest mode decays to this within the horizon
};

/// Why nothing is proved for such a time scheme; empty where certify() works: zero-order hold and
/// implicit Euler.
std::string_view why_uncertified(Discretization discretization) noexcept;

/// The certificate of `reduced` (its period, discretization and ranges of alpha and beta) against
/// `full`, of whose impulse response all modes count; for two parameters every bound is the largest
/// over beta. Throws Error if why_uncertified() has a reason or the
/// reduced transition matrix cannot be diagonalised well. Allocates 16 bytes x nodes of
/// alpha x horizon, and what FullImpulse keeps.
ErrorCertificate certify(const ReducedModel& reduced, const FullOrderModel& full,
                         const CertificateSettings& settings = {});

}  // namespace photocoag
