// The journal of a session: what it keeps when the program dies within a line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "photocoag/core/files.hpp"
#include "photocoag/session/session_journal.hpp"
#include "session/sessions.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

class Journal : public ::testing::Test {
 protected:
  Journal() {
    write_file(folder_.file("session.toml"), small_session());
    session_ = load_session(folder_.file("session.toml"));
    file_ = folder_.file("journal");
  }
  AttemptOutcome begun(const std::string& name, int attempt = 1) const {
    AttemptOutcome outcome;
    outcome.spot = name;
    outcome.attempt = attempt;
    outcome.folder = "spots/x";
    outcome.ending = SpotEnding::kMayHaveEmitted;
    outcome.energy_mJ = 2.0;
    return outcome;
  }
  AttemptOutcome done(const std::string& name, int attempt = 1) const {
    AttemptOutcome outcome = begun(name, attempt);
    outcome.ending = SpotEnding::kTreated;
    outcome.energy_mJ = 0.5;
    outcome.absorption = 0.25;
    return outcome;
  }
  std::string text() const { return read_file(file_, 1'000'000); }

  TemporaryFolder folder_;
  Session session_;
  std::string file_;
};

TEST_F(Journal, AnIntentWithoutAnOutcomeMayHaveEmittedAndIsNotWantedAgain) {
  {
    SessionJournal journal(file_, session_);
    EXPECT_FALSE(journal.continued());
    journal.intend(0, begun("A"));
    journal.finish(0, done("A"));
    journal.intend(1, begun("B"));
  }
  SessionJournal again(file_, session_);
  EXPECT_TRUE(again.continued());
  ASSERT_EQ(again.attempts().size(), 2U);
  EXPECT_EQ(again.spots()[0].ending(), SpotEnding::kTreated);
  EXPECT_EQ(again.spots()[0].attempts[0].absorption, 0.25);
  EXPECT_TRUE(std::isnan(again.spots()[0].attempts[0].held_error_K));
  EXPECT_EQ(again.spots()[1].ending(), SpotEnding::kMayHaveEmitted);
  EXPECT_FALSE(again.spots()[1].wanted);
  EXPECT_EQ(again.spots()[2].ending(), SpotEnding::kPlanned);
  EXPECT_TRUE(again.spots()[2].wanted);
  // Of B all that it could have emitted.
  EXPECT_DOUBLE_EQ(again.energy(), 2.5e-3);
  again.repeat(1);
  again.skip(2);
  EXPECT_TRUE(again.spots()[1].wanted);
  EXPECT_EQ(again.spots()[2].ending(), SpotEnding::kSkipped);
}

TEST_F(Journal, WhereverALineIsCutTheSpotsBeforeItAreThere) {
  {
    SessionJournal journal(file_, session_);
    journal.intend(0, begun("A"));
    journal.finish(0, done("A"));
    journal.intend(1, begun("B"));
    journal.repeat(1);
  }
  const std::string whole = text();
  std::vector<std::size_t> ends;
  for (std::size_t at = 0; (at = whole.find('\n', at)) != std::string::npos; ++at) {
    ends.push_back(at + 1);
  }
  ASSERT_EQ(ends.size(), 5U);
  for (std::size_t cut = 0; cut <= whole.size(); cut += 37) {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << whole.substr(0, cut);
    SessionJournal journal(file_, session_);
    const auto lines =
        std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= cut; });
    EXPECT_EQ(journal.attempts().size(), lines >= 4 ? 2U : lines >= 2 ? 1U : 0U) << cut;
    EXPECT_EQ(journal.spots()[0].ending(), lines >= 3   ? SpotEnding::kTreated
                                           : lines == 2 ? SpotEnding::kMayHaveEmitted
                                                        : SpotEnding::kPlanned);
    EXPECT_EQ(journal.spots()[1].wanted, lines != 4) << cut;
  }
}

TEST_F(Journal, ADamagedLineBeforeTheLastIsNotGuessedAt) {
  {
    SessionJournal journal(file_, session_);
    journal.intend(0, begun("A"));
    journal.finish(0, done("A"));
  }
  std::string damaged = text();
  damaged[damaged.find('\n') + 30] ^= 1;
  std::ofstream(file_, std::ios::binary | std::ios::trunc) << damaged;
  EXPECT_NE(message_of([&] { SessionJournal(file_, session_); }).find("a line is damaged"),
            std::string::npos);
}

TEST_F(Journal, BelongsToOneSessionAndOneProcess) {
  SessionJournal journal(file_, session_);
  EXPECT_NE(message_of([&] { SessionJournal(file_, session_); }).find("another process"),
            std::string::npos);
  const std::string other_file = folder_.file("other");
  { SessionJournal other(other_file, session_); }
  Session changed = session_;
  changed.configs[0].control.peak_reference = 25.0;
  EXPECT_NE(message_of([&] { SessionJournal(other_file, changed); }).find("another session"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
