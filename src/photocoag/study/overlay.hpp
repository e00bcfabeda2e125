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
  std::optional<double> absorption_initial = {};  ///< before the first sample
  Ink ink = Ink::kSeries1;
  Dash dash = Dash::kSolid;
};

/// The first seed of a result.
OverlayCurve overlay_curve(std::string label, const RunResult& result);

/// Content of a figure of closed loops.
struct OverlayView {
  double end_ms = 60.0;
  bool estimate = false;  ///< true: the estimated peak, as observed in an experiment
  std::optional<OverlayCurve> against = {};  ///< one more panel: the peaks less that of this loop
};

/// Panels from 0 to end_ms: peak, volume temperature, power, estimated absorption factor from its
/// initial value on. The tissue is cold at the start, and the first power holds from there.
Figure overlay_figure(const std::vector<OverlayCurve>& curves, const OverlayView& view);

/// More curves than these cannot be told apart: six inks, three dashes.
inline constexpr std::size_t kMostCurves = 18;

/// Over the longest run, and over the heating phase if the run is longer than that; an ink and a
/// dash for each of the first kMostCurves; further curves are not drawn.
std::vector<Figure> overlay_figures(std::vector<OverlayCurve> curves);

}  // namespace photocoag
