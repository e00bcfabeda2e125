// Role: offline; many closed loops over one time axis: peak, power, absorption. Used by reproduce,
// sweep and compare. Units: K, mW, ms. Real-time promise: none.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "photocoag/page/figure.hpp"
#include "photocoag/study/run_set.hpp"

namespace photocoag {

struct OverlayCurve {
  std::string label = {};
  Trajectory loop = {};
  double limit_K = 0.0;
  double reference_K = 0.0;
  std::optional<double> absorption_true = {};
  Ink ink = Ink::kSeries1;
  Dash dash = Dash::kSolid;
};

/// The first seed of a result.
OverlayCurve overlay_curve(std::string label, const RunResult& result);

/// Three panels from 0 to `end_ms`: peak, power, estimated absorption factor. The tissue is cold at
/// the start, and the first power holds from there.
Figure overlay_figure(const std::vector<OverlayCurve>& curves, double end_ms);

/// More curves than these cannot be told apart: six inks, three dashes.
inline constexpr std::size_t kMostCurves = 18;

/// Over the longest run, and over the heating phase if the run is longer than that; an ink and a
/// dash for each of the first kMostCurves, the others are left out.
std::vector<Figure> overlay_figures(std::vector<OverlayCurve> curves);

}  // namespace photocoag
