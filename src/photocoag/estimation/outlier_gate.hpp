// Role: online; statistical gate on the innovation, with a rule that keeps a real change from being
// locked out. Used by the estimators. Source: validation gate, Bar-Shalom, Li and Kirubarajan
// (2001), section 7.2; docs/equations.md (E25). Difference: the gate widens with every sample
// that it rejects. Real time: noexcept, no allocation.
#pragma once

#include <algorithm>
#include <cmath>

namespace photocoag {

/// A sample passes if |innovation| <= sigmas 2^r sigma. r starts at 0, each rejected sample adds 1,
/// each one inside of the plain gate (2^0) takes 1 away. So a lone outlier is rejected; of a
/// lasting change of d sigma at most ceil(log2(d / sigmas)) samples are rejected in a row, and the
/// gate stays wide while the estimate follows. Innovations that are not finite pass: the
/// estimator's own check of its health has to see them.
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
  static constexpr int kMostDoublings = 60;  // as good as open

  double sigmas_;
  int doublings_ = 0;
};

}  // namespace photocoag
