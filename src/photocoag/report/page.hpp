// Role: offline; the HTML of a report. Used by report.
// Units: on the page every number carries its unit. Real-time promise: none. Threads: none.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "photocoag/page/page.hpp"
#include "photocoag/report/run_log.hpp"

namespace photocoag {

/// One part of the run: its figures over one time axis.
struct FigureColumn {
  std::string heading;
  std::vector<Figure> figures;
};

/// The whole page. `folder`: the run folder as the user named it; `field`: the figure of the
/// temperature field, may be absent; `histograms`: of the cycles' durations, may be empty.
std::string report_page(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                        const std::vector<FigureColumn>& parts, const std::optional<Figure>& field,
                        const std::vector<Figure>& histograms, const std::string& folder);

namespace page_detail {

/// Tables of key numbers, solver and timing.
Html summary_section(const RunLog& log, const RunSummary& summary, const RunConfig& config);
Html timing_section(const RunSummary& summary, const std::vector<Figure>& histograms);
/// First 10 and last 3 cycles.
Html cycles_table(const RunLog& log);

/// "wake_late_us" -> {"wake late", "µs"}; without a unit the second is empty.
std::pair<std::string, std::string> name_and_unit(std::string name);

/// `value` with `digits` digits, a true minus sign and its unit; an en dash if there is no value.
std::string quantity(std::optional<double> value, int digits, std::string_view unit);

}  // namespace page_detail
}  // namespace photocoag
