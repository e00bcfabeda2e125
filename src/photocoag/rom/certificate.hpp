// Role: online and offline; the proved error bound of a reduced model, worst-case and running. Made
// by mor/certificate, stored in the model file. Used by mor, rom, mpc. Source: derived here;
// docs/models.md (certificate). Statement: if the full-order and the reduced model start cold with
// the same alpha (and beta) in the certificate's range and the same powers u_k >= 0, each held over
// one period, their outputs differ at every sample instant by no more than the bounds below. It
// does not hold between sample instants or for another period, and it does not cover a filter's
// estimate, which is driven by measurements of the true tissue: there the volume bound acts as a
// bounded bias of the measurement. Units: SI; bounds in K. Real time: RunningErrorBound is noexcept
// and allocation-free but for its constructor. Threads: plain data; RunningErrorBound has one
// owner.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "photocoag/core/outputs.hpp"

namespace photocoag {

inline constexpr int kMaxMajorantTerms = 8;

/// One output's part. Vectors have one entry per node of alpha (`majorant`: per decay);
/// interpolated linearly, they hold between nodes too.
struct OutputCertificate {
  /// K/W; >= max(sum_k e_k^+, sum_k e_k^-), e_k = h_full,k - h_reduced,k, k = 1, 2, …: for powers
  /// from 0 to 1 W, attained by on/off powers.
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
  std::vector<double> decay;        ///< lambda_j per period, in [0, 1), shared by both outputs
  double treatment_duration = 0.0;  ///< s, whole periods
  std::size_t horizon = 0;          ///< periods summed explicitly; beyond it a proved tail
  double tail_relative = 0.0;  ///< share of the tail in the bounds, relative to the steady gain

  /// Bounds at all times for powers 0 <= u <= power_max, K. `alpha` is clamped to the range of the
  /// nodes.
  Outputs bound(double alpha, double power_max) const noexcept;

  /// Throws Error naming the first entry that cannot be right: sizes, order of the nodes, values
  /// that are negative or not finite, decays outside [0, 1).
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
