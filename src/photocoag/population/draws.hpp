// Role: studies; random numbers for their eyes. Used by population. Real time: noexcept.
#pragma once

#include <cstdint>

#include "photocoag/core/random.hpp"

namespace photocoag {

/// Independent random numbers of one eye of a study, by the index of the draw.
class StudyDraws {
 public:
  StudyDraws(int seed, std::uint64_t purpose) noexcept
      : seed_(static_cast<std::uint64_t>(seed) * 16 + purpose) {}
  double uniform(std::uint64_t k) const noexcept {
    return photocoag::uniform(seed_, k, RandomStream::kStudy);
  }
  double normal(std::uint64_t k) const noexcept {
    return standard_normal(seed_, k, RandomStream::kStudy);
  }

 private:
  std::uint64_t seed_;
};

/// Random quantities of a spot: alpha uniform over [low, high], the declared quantities of
/// [uncertainty] uniform within their ranges, the noise. Seed s always gives the same spot s.
struct SpotRange {
  double alpha_low = 0.35;
  double alpha_high = 1.5;

  /// `number`: uniform in (0, 1).
  double alpha(double number) const noexcept {
    return alpha_low + (alpha_high - alpha_low) * number;
  }
};

}  // namespace photocoag
