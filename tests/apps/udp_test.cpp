// `treat --device udp:…` with the example acquisition program, as a user runs the two.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <thread>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;

int free_port() {
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  bind(socket, reinterpret_cast<const sockaddr*>(&address), size);
  getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  close(socket);
  return ntohs(address.sin_port);
}

bool within(double seconds, const std::function<bool()>& there) {
  for (int i = 0; i < seconds * 50; ++i) {
    if (there()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return there();
}

/// examples/udp/acquisition.py, as long as this lives.
class Acquisition {
 public:
  Acquisition(const Sandbox& sandbox, int period_ms) : said_(sandbox.path("said")) {
    const std::string pid = sandbox.path("pid");
    const std::string command =
        "python3 '" PHOTOCOAG_SOURCE_DIR "/examples/udp/acquisition.py' --port " +
        std::to_string(port_) + " --period-ms " + std::to_string(period_ms) + " >'" + said_ +
        "' 2>&1 & echo $! >'" + pid + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    pid_ = std::stoi(read_all(pid));
    EXPECT_TRUE(within(30, [&] { return said("hello") == 1; })) << read_all(said_);
  }
  ~Acquisition() { kill(pid_, SIGTERM); }
  Acquisition(const Acquisition&) = delete;
  Acquisition& operator=(const Acquisition&) = delete;

  std::string device() const { return "udp:" + std::to_string(port_); }
  /// How many lines begin so.
  long said(const std::string& word) const {
    std::istringstream lines(read_all(said_));
    long count = 0;
    for (std::string line; std::getline(lines, line);) count += line.starts_with(word) ? 1 : 0;
    return count;
  }
  std::string all() const { return read_all(said_); }

 private:
  std::string said_;
  int port_ = free_port();
  int pid_ = 0;
};

const std::string kSlow = " --set control.period_ms=4";

TEST(TreatUdp, TheExampleIsTreatedTwice) {
  const Sandbox sandbox;
  const Acquisition program(sandbox, 4);
  int treated = 0;
  std::string said;
  for (int attempt = 0; attempt < 6 && treated < 2; ++attempt) {
    const std::string run = "run" + std::to_string(attempt);
    const ProgramResult result = sandbox.run("treat --device " + program.device() + kSlow +
                                             " --set run.duration_ms=400 --out " + run);
    // Where the machine holds one of the two up for some periods the supervisor stops.
    ASSERT_NE(result.exit_code, 2) << result.err;
    said += result.err;
    if (result.exit_code != 0) continue;
    ++treated;
    const Json summary = Json::parse(read_all(sandbox.path(run) / "summary.json"));
    EXPECT_EQ(summary["cycles"], 100);
    EXPECT_EQ(summary["device"]["name"], "udp, acquisition.py: five time constants");
    EXPECT_NE(summary["device"]["status"].get<std::string>().find("0 foreign, 0 unreadable"),
              std::string::npos);
    EXPECT_TRUE(summary["absorption_error_final"].is_null()) << "nobody knows its eye";
    std::smatch estimated;
    ASSERT_TRUE(std::regex_search(result.err, estimated,
                                  std::regex("absorption factor ([0-9.]+) estimated\n")));
    EXPECT_NEAR(std::stod(estimated[1]), 0.7363, 0.1) << "of the response that it has";
    EXPECT_EQ(sandbox.run("replay " + run).exit_code, 0) << "the same powers to the last bit";
  }
  if (treated < 2 && program.said("no real-time priority") > 0) GTEST_SKIP() << "too busy";
  ASSERT_EQ(treated, 2) << said;
  EXPECT_GE(program.said("welcome"), 2);
  // The self-test's milliwatt, each time.
  EXPECT_GE(program.said("watchdog: 0.0010 W"), 2) << program.all();
}

TEST(TreatUdp, AKilledTreatmentLeavesTheProgramDark) {
  const Sandbox sandbox;
  const Acquisition program(sandbox, 4);
  const std::string pid = sandbox.path("treat-pid");
  std::thread killer([&] {
    if (!within(300, [&] { return program.said("watchdog: 0.0010 W") > 0; })) return;
    std::this_thread::sleep_for(std::chrono::seconds(2));  // the self-test's rest, and some light
    kill(std::stoi(read_all(pid)), SIGKILL);
  });
  const ProgramResult result =
      sandbox.run("treat --device " + program.device() + kSlow +
                      " --set run.duration_ms=60000 --set safety.supervisor=off --out run",
                  "sh -c 'echo $$ >treat-pid; exec \"$0\" \"$@\"'");
  killer.join();
  ASSERT_EQ(result.exit_code, 137) << result.err;
  ASSERT_TRUE(within(30, [&] { return program.said("silence") > 0; })) << program.all();
  const std::string all = program.all();
  const std::regex line("watchdog: ([0-9.]+) W until ([0-9.]+) ms after the last token");
  double most = 0.0;
  for (std::sregex_iterator match(all.begin(), all.end(), line), end; match != end; ++match) {
    most = std::max(most, std::stod((*match)[1]));
    EXPECT_LE(std::stod((*match)[2]), 8.0) << "two periods: " << match->str();
  }
  EXPECT_GT(most, 0.005) << "there was light when it was killed: " << all;
}

TEST(TreatUdp, AnotherPeriodIsExitCode3) {
  const Sandbox sandbox;
  const Acquisition program(sandbox, 5);
  const ProgramResult result = sandbox.run("treat --device " + program.device() + kSlow +
                                           " --set grid.min_cells=2000 --out run");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("another control period; found 5 ms"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace photocoag::testing
