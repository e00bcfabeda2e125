// The page and the files of a session.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "photocoag/core/files.hpp"
#include "photocoag/session/session_record.hpp"
#include "photocoag/session/session_report.hpp"
#include "session/sessions.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

/// Every ending once, on a grid.
struct EveryEnding {
  TemporaryFolder folder;
  Session session;
  SessionResult result;

  EveryEnding() {
    write_file(folder.file("s.toml"),
               "[session]\ntitle = \"<all> of them\"\n"
               "[grid]\nrows = 3\ncolumns = 3\nspacing_um = 300\n");
    session = load_session(folder.file("s.toml"));
    for (std::size_t k = 0; k < kSpotEndings; ++k) {
      const auto ending = static_cast<SpotEnding>(k);
      SpotHistory spot;
      spot.skipped = ending == SpotEnding::kSkipped;
      if (ending != SpotEnding::kPlanned && !spot.skipped) {
        AttemptOutcome attempt;
        attempt.spot = session.spots[k].name;
        attempt.attempt = 1;
        attempt.folder = "spots/" + attempt.spot;
        attempt.ending = ending;
        attempt.absorption = 0.5 + 0.1 * static_cast<double>(k);
        attempt.absorption_sigma = 0.01;
        attempt.energy_mJ = 3.0;
        spot.attempts = {attempt};
        result.attempts.push_back(attempt);
      }
      result.spots.push_back(spot);
    }
    result.energy = 21e-3;
  }
};

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++count;
  return count;
}

TEST(SessionReport, TheMapTellsEveryEndingByWordAndShapeBesideColour) {
  const EveryEnding every;
  const std::string page = session_page(every.session, every.result);
  std::set<std::string> shapes;
  for (std::size_t k = 0; k < kSpotEndings; ++k) {
    const auto ending = static_cast<SpotEnding>(k);
    const std::string title =
        every.session.spots[k].name + ": " + std::string(words_of(ending)) + "</title>";
    ASSERT_EQ(count_of(page, title), 2U) << "on the wide and the narrow map: " << title;
    const std::size_t at = page.find(" d=\"", page.find(title));
    shapes.insert(page.substr(at, page.find('"', at + 4) - at));
  }
  EXPECT_EQ(shapes.size(), kSpotEndings) << "no two endings share a shape";
  EXPECT_EQ(page.find("<all>"), std::string::npos) << "escaped";
  EXPECT_NE(page.find("href=\"spots/A2/report.html\""), std::string::npos);
  EXPECT_EQ(page, session_page(every.session, every.result));
}

TEST(SessionReport, TheRecordCountsWhatHappened) {
  const EveryEnding every;
  const auto json = nlohmann::json::parse(session_json(every.session, every.result));
  EXPECT_EQ(json["spots"], 9);
  EXPECT_EQ(json["treated_spots"], 3) << "treated, goal missed, over the limit";
  EXPECT_EQ(json["may_have_emitted_spots"], 1);
  EXPECT_EQ(json["stopped_spots"], 1);
  EXPECT_EQ(json["attempt"].size(), 7U);
  EXPECT_NEAR(json["absorption_mean"].get<double>(), 0.7, 1e-12);
  EXPECT_EQ(json["plan"][8]["ending"], "skipped");
  EXPECT_NEAR(json["energy_mJ"].get<double>(), 21.0, 1e-12);
}

TEST(SessionReport, ASessionWithoutAnAttemptHasAPageToo) {
  EveryEnding every;
  every.result.attempts.clear();
  for (SpotHistory& spot : every.result.spots) spot = {};
  EXPECT_NE(session_page(every.session, every.result).find("0 of 9 spots treated"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
