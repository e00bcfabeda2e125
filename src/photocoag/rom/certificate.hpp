// Role: online and offline; the proved error bound of a reduced model and its running form. Made by
// mor/certificate, stored in the model file. Source: derived here; docs/models.md (certificate).
// What it says: two models start cold, share one alpha (and beta) in the certificate's range and
// get the same powers u_k >= 0, held over one period. At every sample instant the outputs of the
// full-order and the reduced model then differ by no more than the bounds below. What it does not
// say: anything about a filter's estimate, which is driven by measurements of the true tissue;
// there the volume part acts as a bounded bias of the measurement. Between sample instants and for
// another period it does not hold. Units: SI; bounds in K. Real time: RunningErrorBound is noexcept
// and allocation-free but for its constructor. Threads: plain data; RunningErrorBound has one
// owner.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "photocoag/core/outputs.hpp"

namespace photocoag {

inline constexpr int kMaxMajorantTerms = 8;

/// One output's part. All vectors have one entry per node of alpha and are meant to be interpolated
/// linearly between nodes, where they hold as well.
struct OutputCertificate {
  /// K/W; >= max(sum_k e_k^+, sum_k e_k^-), e_k = h_full,k - h_reduced,k, k = 1, 2, …: what powers
  /// from 0 to 1 W can do, attained by on/off powers.
  std::vector<double> bound;
  std::vector<double> relative;  ///< bound / steady gain of the full-order model
  /// The same for the first ErrorCertificate::treatment_duration only.
  std::vector<double> treatment_bound;
  std::vector<double> treatment_relative;
  std::vector<double> sum;       ///< K/W; >= sum_k |e_k|: for powers from -1 to 1 W
  std::vector<double> scale;     ///< K/W: |e_k| <= scale * m_k at every k
  std::vector<double> majorant;  ///< c_j >= 0 of m_k = sum_j c_j lambda_j^(k-1)

  double relative_max() const noexcept;
  double treatment_relative_max() const noexcept;
};

struct ErrorCertificate {
  std::vector<double> absorption_factors;  ///< nodes of alpha, ascending
  OutputCertificate peak;
  OutputCertificate volume;
  std::vector<double> decay;        ///< lambda_j per period, in (0, 1), shared by both outputs
  double treatment_duration = 0.0;  ///< s, whole periods
  std::size_t horizon = 0;     ///< periods that were summed one by one; the rest is a proved tail
  double tail_relative = 0.0;  ///< share of the tail in the bounds, relative to the steady gain

  /// Bounds for every power 0 <= u <= power_max at any time, K. `alpha` is clamped to the range of
  /// the nodes.
  Outputs bound(double alpha, double power_max) const noexcept;

  /// Throws Error naming the first entry that cannot be right: sizes, order of the nodes, values
  /// that are negative or not finite, decays outside (0, 1).
  void validate() const;
};

/// The bound for the powers applied so far: b_j <- lambda_j b_j + u, bound = scale sum_j c_j b_j.
/// Test: tests/mor/certificate_test.cpp.
class RunningErrorBound {
 public:
  /// Throws Error if the certificate is not valid. Keeps a copy.
  explicit RunningErrorBound(const ErrorCertificate& certificate);

  /// Cold tissue.
  void reset() noexcept;
  /// One period with `power`, W, not negative.
  void step(double power) noexcept;
  /// At the end of the last period, for this alpha (clamped to the range of the nodes), K.
  Outputs bound(double alpha) const noexcept;

 private:
  ErrorCertificate certificate_;
  std::array<double, kMaxMajorantTerms> state_{};
};

}  // namespace photocoag
