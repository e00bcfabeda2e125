// The one exception type: its message has every part that there is, and no separators for those
// that are not.
#include "photocoag/core/error.hpp"

#include <gtest/gtest.h>

#include <string>

#include "photocoag/core/check.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::message_of;
using testing::thrown_by;

TEST(Error, NamesEverythingThatIsKnown) {
  const Error error(ErrorParts{.where = "a.toml:3",
                               .key = "control.period_ms",
                               .problem = "not usable",
                               .found = "-1",
                               .accepted = "above 0"});
  EXPECT_STREQ(error.what(),
               "a.toml:3: control.period_ms: not usable; found -1; accepted: above 0");
}

TEST(Error, NeedsNoProblemWhenFoundAndAcceptedSayItAll) {
  const Error error(ErrorParts{.key = "k", .found = "x", .accepted = "y"});
  EXPECT_STREQ(error.what(), "k: found x; accepted: y");
}

// Every subset of the parts: each given part appears once, in order, and no separator is left over.
TEST(Error, HasNoStraySeparatorForAnySubsetOfParts) {
  const std::string names[5] = {"WHERE", "KEY", "PROBLEM", "FOUND", "ACCEPTED"};
  for (unsigned subset = 1; subset < 32; ++subset) {
    const auto part = [&](unsigned i) {
      return (subset >> i & 1U) != 0 ? names[i] : std::string();
    };
    const std::string text = Error(ErrorParts{.where = part(0),
                                              .key = part(1),
                                              .problem = part(2),
                                              .found = part(3),
                                              .accepted = part(4)})
                                 .what();
    std::size_t last = 0;
    for (unsigned i = 0; i < 5; ++i) {
      const std::size_t at = text.find(names[i]);
      ASSERT_EQ(at != std::string::npos, (subset >> i & 1U) != 0) << text;
      if (at == std::string::npos) continue;
      EXPECT_GE(at, last) << text;
      last = at;
      EXPECT_EQ(text.find(names[i], at + 1), std::string::npos) << text;
    }
    EXPECT_NE(text.front(), ':') << text;
    EXPECT_NE(text.front(), ';') << text;
    EXPECT_NE(text.front(), ' ') << text;
    EXPECT_TRUE(std::isupper(static_cast<unsigned char>(text.back()))) << text;
  }
}

TEST(Error, AtAddsThePlaceButKeepsTheFirstOne) {
  const Error bare(ErrorParts{.key = "k", .problem = "p"});
  EXPECT_STREQ(bare.at("f.json").what(), "f.json: k: p");
  EXPECT_STREQ(bare.at("f.json").at("g.json").what(), "f.json: k: p");
  EXPECT_EQ(bare.at("f.json").parts().where, "f.json");
  EXPECT_EQ(bare.parts().where, "");
}

TEST(Check, RequireThrowsOnlyIfNotOk) {
  EXPECT_NO_THROW(require(true, "k", 1.0, "anything"));
  const ErrorParts parts = thrown_by([] { require(false, "k", 0.25, "at least 1 mm"); });
  EXPECT_EQ(parts.key, "k");
  EXPECT_EQ(parts.found, "0.25");
  EXPECT_EQ(parts.accepted, "at least 1 mm");
}

}  // namespace
}  // namespace photocoag
