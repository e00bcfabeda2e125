// Role: offline; the HTML of a report. Used by report.
// Units: on the page every number carries its unit. Real-time promise: none. Threads: none.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "photocoag/report/run_log.hpp"

namespace photocoag {

/// One part of the run, drawn for wide and for narrow pages (same order, same number).
struct FigureColumn {
  std::string heading;
  std::vector<std::string> wide, narrow;  ///< inline SVG
};

/// The temperature field, drawn for wide and for narrow pages; empty if the run has none.
struct FieldPicture {
  std::string wide, narrow;  ///< inline SVG
};

/// The whole page. `folder`: the run folder as the user named it; `histograms`: of the cycles'
/// durations, may be empty.
std::string report_page(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                        const std::vector<FigureColumn>& figures, const FieldPicture& field,
                        const FigureColumn& histograms, const std::string& folder);

/// The page's style, without the drawings' (plot_css).
std::string_view page_css() noexcept;

namespace page_detail {

/// Tables of key numbers, solver and timing.
std::string summary_section(const RunLog& log, const RunSummary& summary, const RunConfig& config);
std::string timing_section(const RunSummary& summary, const FigureColumn& histograms);
/// First 10 and last 3 cycles.
std::string cycles_table(const RunLog& log);

/// The drawings below or beside each other; wide ones or narrow ones, as the page is.
std::string stack(const FigureColumn& column);

/// "wake_late_us" -> {"wake late", "µs"}; without a unit the second is empty.
std::pair<std::string, std::string> name_and_unit(std::string name);

/// `value` with `digits` digits, a true minus sign and its unit; an en dash if there is no value.
std::string quantity(std::optional<double> value, int digits, std::string_view unit);

}  // namespace page_detail
}  // namespace photocoag
