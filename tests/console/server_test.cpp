// The console's server from outside: who is let in, what is refused, and that all of it is bounded.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "console/consoles.hpp"
#include "photocoag/console/token.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag::testing {
namespace {

std::string get(Console& console, const std::string& path, const std::string& host = "",
                const std::string& method = "GET") {
  RawClient client(console.server->port());
  const std::string own = fmt::format("127.0.0.1:{}", console.server->port());
  client.send(fmt::format("{} {} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", method, path,
                          host.empty() ? own : host));
  return client.read_all(2.0);
}

// Nobody hears anything further: a close frame, or the end.
bool turned_away(RawClient& client) {
  const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(kPatience * 1e9);
  while (monotonic_ns() < end) {
    if (!client.hear(kPatience)) return monotonic_ns() < end;
  }
  return false;
}

bool has_code(const std::string& answer, int code) {
  return answer.starts_with(fmt::format("HTTP/1.1 {}", code)) ||
         answer.starts_with(fmt::format("HTTP/1.0 {}", code));
}

TEST(ConsoleServer, ServesThePageWithAStrictPolicy) {
  Console console;
  const std::string page = get(console, "/");
  EXPECT_TRUE(has_code(page, 200)) << page.substr(0, 200);
  EXPECT_NE(page.find("content-security-policy: default-src 'none'; script-src 'self'"),
            std::string::npos)
      << page.substr(0, 800);
  EXPECT_NE(page.find("Research software, not a medical device."), std::string::npos);
  EXPECT_EQ(page.find(console.token), std::string::npos) << "the page holds no secret";
  for (const char* path : {"/app.js", "/app.css", "/icon.svg"}) {
    const std::string file = get(console, path);
    EXPECT_TRUE(has_code(file, 200)) << path;
    EXPECT_TRUE(file.ends_with(page_file(path)->content)) << path;
  }
}

TEST(ConsoleServer, HasNothingElse) {
  Console console;
  for (const char* path : {"/../etc/passwd", "/..%2f..%2fetc/passwd", "/nothing",
                           "/runs/1/report.html", "//etc/passwd"}) {
    const std::string answer = get(console, path);
    EXPECT_FALSE(has_code(answer, 200)) << path;
    EXPECT_EQ(answer.find("root:"), std::string::npos) << path;
  }
  EXPECT_FALSE(has_code(get(console, "/", "", "POST"), 200));
  EXPECT_FALSE(has_code(get(console, "/", "", "DELETE"), 200));
}

// A page on evil.example whose name suddenly means 127.0.0.1.
TEST(ConsoleServer, RefusesAnotherNameOfThisMachine) {
  Console console;
  EXPECT_TRUE(has_code(get(console, "/", "evil.example"), 403));
  EXPECT_TRUE(
      has_code(get(console, "/", fmt::format("evil.example:{}", console.server->port())), 403));
  EXPECT_TRUE(
      has_code(get(console, "/", fmt::format("localhost:{}", console.server->port())), 200));
  EXPECT_EQ(console.server->refusals().origin, 2U);
}

TEST(ConsoleServer, ListensOnLoopbackAlone) {
  Console console;
  EXPECT_TRUE(console.server->address().starts_with(
      fmt::format("http://127.0.0.1:{}/#token=", console.server->port())));
}

TEST(ConsoleServer, APortThatIsTakenIsAnError) {
  Console console;
  EXPECT_THROW(ConsoleServer({.port = console.server->port(), .token = "x", .limits = {}},
                             console.desk.hooks(page_file, nullptr)),
               Error);
}

TEST(ConsoleServer, LetsInWhoHasTheTokenAndComesFromItsOwnPage) {
  Console console;
  const std::uint16_t port = console.server->port();
  const auto code = [&](RawClient::Upgrade how) { return RawClient(port).upgrade(how); };
  const std::string ours = fmt::format("http://127.0.0.1:{}", port);
  EXPECT_EQ(code({.token = console.token, .origin = ours, .host = {}}), 101);
  EXPECT_EQ(code({.token = console.token, .origin = {}, .host = {}}), 101) << "no browser";
  struct Case {
    const char* what;
    RawClient::Upgrade how;
  };
  const Case cases[] = {
      {"no token", {.token = {}, .origin = ours, .host = {}}},
      {"wrong token", {.token = std::string(32, '0'), .origin = ours, .host = {}}},
      {"half a token", {.token = console.token.substr(0, 16), .origin = ours, .host = {}}},
      {"long token", {.token = console.token + "0", .origin = ours, .host = {}}},
      {"another page", {.token = console.token, .origin = "http://evil.example", .host = {}}},
      {"a file", {.token = console.token, .origin = "null", .host = {}}},
      {"another port", {.token = console.token, .origin = "http://127.0.0.1:1", .host = {}}},
      {"another name", {.token = console.token, .origin = ours, .host = "evil.example"}}};
  for (const Case& test : cases) EXPECT_NE(code(test.how), 101) << test.what;
  EXPECT_EQ(console.server->refusals().token, 4U);
  EXPECT_EQ(console.server->refusals().origin, 4U);
  EXPECT_EQ(console.logged().size(), 8U);
}

TEST(ConsoleServer, SpeaksAtOnceAndGoesOnSpeaking) {
  Console console;
  RawClient client = console.client();
  EXPECT_TRUE(client.hear(kPatience).value_or("").starts_with("{\"type\":\"hello\""));
  EXPECT_EQ(client.hear(kPatience), "{\"type\":\"before\"}");
  EXPECT_TRUE(client.hear_of("\"type\":\"role\"", kPatience));
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(client.hear_of("\"type\":\"live\"", kPatience));
}

TEST(ConsoleServer, ClosesForMessagesThatAreTooLarge) {
  Console console;
  struct Case {
    const char* what;
    std::string bytes;
  };
  const std::string large(2000, 'a');
  const Case cases[] = {
      {"1 MB", web_frame(1, std::string(1 << 20, 'a'))},
      {"2 kB", web_frame(1, large)},
      {"claims 2 GB and sends little", web_frame(1, "{}", std::uint64_t{1} << 31)},
      {"claims 2^62", web_frame(1, "{}", std::uint64_t{1} << 62)},
      {"in many fragments", [] {
         std::string all = web_frame(1, "{", std::nullopt, false);
         for (int k = 0; k < 100; ++k)
           all += web_frame(0, std::string(50, ' '), std::nullopt, false);
         return all;
       }()}};
  std::uint64_t before = 0;
  for (const Case& test : cases) {
    RawClient client = console.client();
    client.send(test.bytes);
    EXPECT_TRUE(turned_away(client)) << test.what;
    EXPECT_GT(console.server->refusals().total(), before) << test.what;
    before = console.server->refusals().total();
  }
  RawClient healthy = console.client();
  EXPECT_NE(ask(healthy, "stop").find("\"done\":true"), std::string::npos);
}

TEST(ConsoleServer, ClosesForMessagesThatAreNone) {
  Console console;
  const std::string bad[] = {web_frame(2, command("stop")),
                             web_frame(1, "stop"),
                             web_frame(1, ""),
                             web_frame(1,
                                       "{\"command\":\"stop\"} "
                                       "x"),
                             web_frame(1, "[\"stop\"]"),
                             web_frame(1, "{\"command\":1}"),
                             web_frame(1, "{\"command\":\"stop\",\"more\":1}"),
                             web_frame(1, std::string(400, '[')),
                             web_frame(1, "{\"command\":\"\xff\xfe\"}"),
                             web_frame(3, "reserved"),
                             "\x81\x05"
                             "plain",
                             std::string(3000, '\xff')};
  for (const std::string& bytes : bad) {
    RawClient client = console.client();
    client.send(bytes);
    EXPECT_TRUE(turned_away(client)) << fmt::format("{:?}", bytes.substr(0, 40));
  }
  EXPECT_FALSE(console.stop) << "none of them is a command";
  RawClient healthy = console.client();
  EXPECT_NE(ask(healthy, "no such").find("no such command"), std::string::npos);
}

TEST(ConsoleServer, ClosesForTooManyMessages) {
  Console console;
  RawClient client = console.client();
  std::string many;
  for (int k = 0; k < 500; ++k) many += web_frame(1, command("stop"));
  client.send(many);
  EXPECT_TRUE(turned_away(client));
  EXPECT_EQ(console.server->refusals().flood, 1U);
}

TEST(ConsoleServer, OfAHundredClientsEightAreLetIn) {
  Console console;
  std::vector<RawClient> crowd;
  int in = 0;
  for (int k = 0; k < 100; ++k) {
    try {
      crowd.emplace_back(console.server->port());
    } catch (const Error&) {
      continue;
    }
    in += crowd.back().upgrade({.token = console.token, .origin = {}, .host = {}}) == 101 ? 1 : 0;
  }
  EXPECT_EQ(in, 8);
  EXPECT_EQ(console.server->refusals().crowd, 92U);
  EXPECT_NE(ask(crowd.front(), "stop").find("\"done\":true"), std::string::npos);
  EXPECT_LE(console.logged().size(), 20U) << "the log is bounded as well";
}

TEST(ConsoleServer, AReaderWhoDoesNotReadIsDropped) {
  const std::string much(64 << 10, 'x');
  std::atomic<int> left{0};
  ConsoleServer server({.port = 0, .token = "t", .limits = {.tick_s = 1e-3}},
                       {.came = [](int) { return std::vector<std::string>(); },
                        .said = [](int, std::string_view) { return std::string("answer"); },
                        .left = [&](int) { ++left; },
                        .tick = [&] { return std::vector<std::string>{much}; },
                        .file = {},
                        .run_file = {},
                        .log = {}});
  RawClient slow(server.port(), 1024);
  ASSERT_EQ(slow.upgrade({.token = "t", .origin = {}, .host = {}}), 101);
  RawClient quick(server.port());
  ASSERT_EQ(quick.upgrade({.token = "t", .origin = {}, .host = {}}), 101);
  for (int k = 0; k < 100'000 && left == 0; ++k) {
    ASSERT_TRUE(quick.hear(kPatience)) << "it is served while the other is not";
  }
  EXPECT_EQ(server.refusals().slow, 1U);
  EXPECT_EQ(left, 1);
}

TEST(ConsoleServer, TokensAreRandom) {
  const std::string one = random_token();
  EXPECT_EQ(one.size(), 32U);
  EXPECT_EQ(one.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(one, random_token());
}

}  // namespace
}  // namespace photocoag::testing
