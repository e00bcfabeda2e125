// Role: studies; the random numbers of their eyes. Used by population. Real time: noexcept.
#pragma once

#include <cstdint>

#include "photocoag/core/random.hpp"

namespace photocoag {

/// Independent numbers of one eye of a study; which is for what is told by the index of the draw.
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

/// What is random about a spot: alpha uniform over [low, high], the declared quantities of
/// [uncertainty] uniform within theirs, the noise. Seed s gives spot s, whatever else is run.
struct SpotRange {
  double alpha_low = 0.35;
  double alpha_high = 1.5;

  /// For a number uniform in (0, 1).
  double alpha(double number) const noexcept {
    return alpha_low + (alpha_high - alpha_low) * number;
  }
};

}  // namespace photocoag
