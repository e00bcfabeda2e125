// Role: offline; text that is safe inside HTML, XML and SVG. Used by report.
#pragma once

#include <string>
#include <string_view>

namespace photocoag {

/// `text` with & < > " ' as entities; control characters other than tab and line feed as U+FFFD.
std::string escape_html(std::string_view text);

}  // namespace photocoag
