// Role: offline; many closed loops over one time axis: peak, power, absorption. Used by sweep and
// compare. Units: K, mW, ms. Real-time promise: none.
#pragma once

#include <string>
#include <vector>

#include "photocoag/page/figure.hpp"
#include "photocoag/study/run_set.hpp"

namespace photocoag {

struct OverlayCurve {
  std::string label;
  Trajectory loop;
  double limit_K = 0.0;
  double reference_K = 0.0;
};

/// More curves than these cannot be told apart: six inks, three dashes.
inline constexpr std::size_t kMostCurves = 18;

/// The first seed of a result.
OverlayCurve overlay_curve(std::string label, const RunResult& result);

/// Over the longest run, and over the heating phase if the run is longer than that; curves beyond
/// kMostCurves are left out.
std::vector<Figure> overlay_figures(const std::vector<OverlayCurve>& curves);

}  // namespace photocoag
