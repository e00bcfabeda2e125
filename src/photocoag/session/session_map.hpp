// Role: offline; map of a session's spots with their outcomes as colour, shape and word.
// Used by session. Units: um on the drawing. Real-time promise: none.
#pragma once

#include <string>
#include <string_view>

#include "photocoag/page/html.hpp"
#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// The mark of an ending beside its words.
Html ending_mark(SpotEnding ending);

/// The map, drawn for wide and for narrow pages; each spot links to its last run folder.
Html session_map(const Session& session, const SessionResult& result);

/// Every ending that occurs, with its mark and its number of spots.
Html map_legend(const SessionResult& result);

/// The style of both.
std::string_view map_css() noexcept;

}  // namespace photocoag
