// Sessions that are killed at random moments: no spot is lost, none is treated
// twice, and no light comes before its intent is on the disk.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "photocoag/core/random.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
constexpr int kKills = 50;

std::string read_all(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The program with a session, in a folder of its own.
class Sessions {
 public:
  explicit Sessions(const std::string& text) {
    std::ofstream(folder_.path() / "s.toml") << text;
    setenv("XDG_CACHE_HOME", (folder_.path() / "cache").c_str(), 1);
  }
  fs::path path(const std::string& name) const { return folder_.path() / name; }

  pid_t start(const std::string& out, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {PHOTOCOAG_PROGRAM, "session", path("s.toml"), "--out",
                                      path(out)};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    for (const int stream : {0, 1, 2}) {
      posix_spawn_file_actions_addopen(&quiet, stream, "/dev/null", O_RDWR, 0);
    }
    pid_t child = -1;
    const int failed =
        posix_spawn(&child, words[0].c_str(), &quiet, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&quiet);
    EXPECT_EQ(failed, 0);
    return child;
  }
  /// Exit code, or 128 + signal.
  static int wait(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  int run(const std::string& out, const std::vector<std::string>& more = {}) const {
    return wait(start(out, more));
  }
  /// Kills it after `delay`, counted from its start or from the journal's next growth. True if it
  /// was still there.
  bool kill_at(const std::string& out, bool after_growth, std::chrono::microseconds delay) const {
    const fs::path journal = path(out) / "session.journal";
    const auto size = [&] {
      std::error_code none;
      const auto bytes = fs::file_size(journal, none);
      return none ? std::uintmax_t{0} : bytes;
    };
    const auto before = size();
    const pid_t child = start(out);
    int status = 0;
    while (after_growth && size() == before) {
      if (waitpid(child, &status, WNOHANG) == child) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    std::this_thread::sleep_for(delay);
    kill(child, SIGKILL);
    return wait(child) == 128 + SIGKILL;
  }

 private:
  TemporaryFolder folder_;
};

std::chrono::microseconds random_time(int kill, double most_ms) {
  const double share = uniform(17, static_cast<std::uint64_t>(kill), RandomStream::kTest);
  return std::chrono::microseconds(static_cast<std::int64_t>(share * most_ms * 1e3));
}

std::map<std::string, int> intents_of(const fs::path& journal) {
  std::map<std::string, int> count;
  std::istringstream lines(read_all(journal));
  for (std::string line; std::getline(lines, line);) {
    if (line.find("\"event\":\"intent\"") == std::string::npos) continue;
    ++count[Json::parse(line.substr(17))["spot"].get<std::string>()];
  }
  return count;
}

TEST(SessionKills, FiftyKillsLoseNoSpotAndRepeatNone) {
  const Sessions sessions(
      "[session]\npacing = \"virtual\"\n"
      "set = [\"grid.min_cells=2000\", \"plant.model=reduced\", \"run.duration_ms=20\"]\n"
      "[grid]\nrows = 10\ncolumns = 16\nspacing_um = 200\n");
  ASSERT_EQ(sessions.run("whole"), 0);
  int kills = 0;
  for (int k = 0; k < 4 * kKills && kills < kKills; ++k) {
    // From the start of the process on, or around the moment at which a spot begins or ends.
    const bool growth = k % 3 != 0;
    if (sessions.kill_at("cut", growth, random_time(k, growth ? 15.0 : 150.0))) ++kills;
  }
  EXPECT_EQ(kills, kKills);
  const int code = sessions.run("cut");
  const Json session = Json::parse(read_all(sessions.path("cut/session.json")));
  EXPECT_EQ(session["end"], "complete");
  const std::map<std::string, int> intents = intents_of(sessions.path("cut/session.journal"));
  int uncertain = 0;
  std::vector<std::string> repeat;
  for (const Json& spot : session["plan"]) {
    const auto name = spot["spot"].get<std::string>();
    ASSERT_TRUE(intents.contains(name)) << name << " is lost";
    EXPECT_EQ(intents.at(name), 1) << name << " was begun twice";
    if (spot["ending"] != "treated") {
      EXPECT_EQ(spot["ending"], "may-have-emitted");
      ++uncertain;
      repeat.insert(repeat.end(), {"--repeat", name});
    }
  }
  EXPECT_EQ(code, uncertain > 0 ? 1 : 0);
  for (const Json& attempt : session["attempt"]) {
    if (attempt["ending"] != "treated") continue;
    const auto folder = attempt["folder"].get<std::string>();
    EXPECT_TRUE(fs::exists(sessions.path("cut") / folder / "report.html")) << folder;
    EXPECT_EQ(read_all(sessions.path("cut") / folder / "run.csv"),
              read_all(sessions.path("whole") / folder / "run.csv"));
  }
  if (repeat.empty()) return;
  EXPECT_EQ(sessions.run("cut", repeat), 0);
  for (const auto& [name, count] : intents_of(sessions.path("cut/session.journal"))) {
    const bool asked = std::find(repeat.begin(), repeat.end(), name) != repeat.end();
    EXPECT_EQ(count, asked ? 2 : 1) << name;
  }
}

TEST(SessionKills, LightNeverComesBeforeItsIntentNorTwiceForOne) {
  const TemporaryFolder place;
  const fs::path light = place.path() / "light";
  const std::string journal = (place.path() / "s/session.journal").string();
  const Sessions sessions(
      "[session]\nafter_stop = \"continue\"\nset = [\"grid.min_cells=2000\", "
      "\"run.duration_ms=20\"]\ndevice = \"driver:" PHOTOCOAG_WITNESS_DRIVER ",journal=" +
      journal + " light=" + light.string() +
      "\"\n[grid]\nrows = 20\ncolumns = 40\nspacing_um = 100\n");
  fs::create_directory_symlink(place.path() / "s", sessions.path("s"));
  fs::create_directory(place.path() / "s");
  constexpr int kFewer = 25;  // each takes a spot's time
  int kills = 0;
  for (int k = 0; k < 4 * kFewer && kills < kFewer; ++k) {
    // A spot's self-test and treatment take some 0.2 s.
    if (sessions.kill_at("s", true, random_time(k + 1000, 300.0))) ++kills;
  }
  EXPECT_EQ(kills, kFewer);
  for (const auto& [name, count] : intents_of(journal)) EXPECT_EQ(count, 1) << name;
  std::istringstream lines(read_all(light));
  int last = 0, lit = 0;
  for (int intents = 0; lines >> intents; ++lit) {
    EXPECT_GT(intents, last) << "light without an intent of its own";
    last = intents;
  }
  EXPECT_GT(lit, 0) << "the driver was never lit";
}

}  // namespace
}  // namespace photocoag::testing
