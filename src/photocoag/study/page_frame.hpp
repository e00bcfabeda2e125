// Role: offline; what the pages of studies, sweeps, comparisons and campaigns share. Used by study
// and campaign. Self-contained pages: no script, no asset outside. Real-time promise: none.
#pragma once

#include <string>
#include <string_view>

namespace photocoag {

/// Up to and including the headline. `kicker`: the small line above; `line`: below the headline;
/// `notice`: after the research notice. All but `css` are escaped.
std::string page_begin(std::string_view title, std::string_view kicker, std::string_view line,
                       std::string_view notice, std::string_view css = {});
std::string page_end();

/// One of the large numbers below the headline; escaped.
std::string page_tile(std::string_view name, std::string_view value, std::string_view note);

/// The unit in the name of a measure: "K" of "peak_max_K"; empty if there is none.
std::string unit_of(std::string_view measure);

/// Four digits and the unit; "never" if infinite, "none" if NaN.
std::string number_text(double value, std::string_view unit);

}  // namespace photocoag
