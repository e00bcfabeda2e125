// Role: online; statistical gate on the innovation that cannot lock out a real change. Used by the
// estimators. Source: validation gate, Bar-Shalom, Li and Kirubarajan (2001), section 7.2;
// docs/equations.md (E25). Difference: the gate widens with every sample that it rejects. Real
// time: noexcept, no allocation.
#pragma once

#include <algorithm>
#include <cmath>

namespace photocoag {

/// A sample passes if |innovation| <= sigmas 2^r sigma. r starts at 0, each rejected sample adds 1,
/// each sample inside the plain gate (r = 0) subtracts 1. So a single outlier is rejected; after a
/// lasting change of d sigma at most ceil(log2(d / sigmas)) samples are rejected in a row, and the
/// gate stays wide while the estimate follows. Non-finite innovations pass, so that the estimator's
/// health check sees them.
class OutlierGate {
 public:
  /// sigmas: half width of the plain gate in standard deviations of the innovation; 0: no gate.
  explicit OutlierGate(double sigmas) noexcept : sigmas_(sigmas) {}

  void reset() noexcept { doublings_ = 0; }

  bool passes(double innovation, double sigma) noexcept {
    if (sigmas_ == 0.0) return true;
    const double plain = sigmas_ * sigma;
    if (!(std::abs(innovation) > plain)) {
      doublings_ = std::max(doublings_ - 1, 0);
      return true;
    }
    if (!(std::abs(innovation) > std::ldexp(plain, doublings_))) return true;
    doublings_ = std::min(doublings_ + 1, kMostDoublings);
    return false;
  }

 private:
  static constexpr int kMostDoublings = 60;  // effectively open

  double sigmas_;
  int doublings_ = 0;
};

}  // namespace photocoag
