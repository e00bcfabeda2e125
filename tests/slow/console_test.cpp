// The console's server and connections that say nothing: closed after some seconds, and meanwhile
// in nobody's way.
#include <gtest/gtest.h>

#include "console/consoles.hpp"

namespace photocoag::testing {
namespace {

TEST(ConsoleServerPatience, SilentConnectionsAreClosed) {
  Console console;
  RawClient operating = console.client();
  std::vector<RawClient> silent;
  for (int k = 0; k < 60; ++k) silent.emplace_back(console.server->port());
  silent.front().send("GET / HTTP/1.1\r\nHo");
  EXPECT_NE(ask(operating, "stop").find("\"done\":true"), std::string::npos);
  EXPECT_TRUE(silent.front().closes_within(kPatience));
  EXPECT_TRUE(silent.back().closes_within(kPatience));
  RawClient late = console.client();
  EXPECT_TRUE(late.hear_of("hello", kPatience)) << "there is room again";
}

}  // namespace
}  // namespace photocoag::testing
