// Output and files at the start and end of a session.
#include "session_ends.hpp"

#include <algorithm>

#include "console.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/session/session_record.hpp"
#include "photocoag/session/session_report.hpp"

namespace photocoag {
namespace {

void write_all(const std::filesystem::path& out, const Session& session,
               const SessionResult& result) {
  write_file((out / "session.json").string(), session_json(session, result));
  write_file((out / "summary.json").string(), session_summary_json(session, result));
  write_session_table(out / "session.h5", session, result);
  write_file((out / "index.html").string(), session_page(session, result));
}

void tell_uncertain(const Session& session, const SessionResult& result) {
  for (std::size_t k = 0; k < session.spots.size(); ++k) {
    if (result.spots[k].ending() != SpotEnding::kMayHaveEmitted || result.spots[k].wanted) continue;
    say("spot {:<6} interrupted, may have emitted: not repeated without --repeat {}\n",
        session.spots[k].name, session.spots[k].name);
  }
}

}  // namespace

void begin_session(const std::filesystem::path& out, const Session& session) {
  if (out.empty()) {
    throw Error(ErrorParts{.where = "--out",
                           .problem = "missing: an interrupted session continues in its folder",
                           .accepted = "a new or empty folder, or that of this session"});
  }
  say("photocoag {}: {}\n", version(), kResearchNotice);
  for (const std::string& key : session.remarks) say("note      no effect here: {}\n", key);
}

int finish_session(const std::filesystem::path& out, const Session& session,
                   const SessionResult& result) {
  write_all(out, session, result);
  tell_uncertain(session, result);
  const SessionTotals totals = totals_of(result);
  say("session   {} of {} spots treated, {} over the limit, {} stopped, {} may have emitted; "
      "{:.4g} mJ\n",
      totals.treated, totals.spots, totals.over_limit, totals.stopped, totals.uncertain,
      totals.energy_mJ);
  if (!result.why.empty()) say("ENDED     {}\n", result.why);
  say("report    {}\n", (out / "index.html").string());
  constexpr int kDeviceFault = 3;
  const bool clean = std::all_of(result.spots.begin(), result.spots.end(), [](const auto& spot) {
    return is_complete(spot.ending()) || spot.ending() == SpotEnding::kSkipped;
  });
  return result.end == SessionEnd::kDeviceFault         ? kDeviceFault
         : result.end == SessionEnd::kComplete && clean ? 0
                                                        : 1;
}

}  // namespace photocoag
