// Every number of the configuration at both ends of its range: the program answers within 10 s of
// processor time and 1 GB, with a result or with a message, whatever the number means.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "photocoag/config/decimal.hpp"
#include "photocoag/config/fields.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag {
namespace {

using testing::TemporaryFolder;

struct Usage {
  int exit_code = -1;  // 128 + signal
  double seconds = 0.0;
  double megabytes = 0.0;
};

// The program prints nothing; its cache lies in the folder.
[[noreturn]] void become_program(const TemporaryFolder& folder, std::vector<std::string> words) {
  const rlimit memory{rlim_t{4} << 30U, rlim_t{4} << 30U};
  const rlimit seconds{60, 60};
  setrlimit(RLIMIT_AS, &memory);
  setrlimit(RLIMIT_CPU, &seconds);
  setenv("XDG_CACHE_HOME", folder.file("cache").c_str(), 1);
  if (std::freopen("/dev/null", "w", stdout) == nullptr) _exit(99);
  if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(99);
  words.insert(words.begin(), PHOTOCOAG_PROGRAM);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(98);
}

Usage run(const TemporaryFolder& folder, const std::vector<std::string>& arguments) {
  const pid_t child = fork();
  if (child == 0) become_program(folder, arguments);
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          .seconds = seconds(used.ru_utime) + seconds(used.ru_stime),
          .megabytes = static_cast<double>(used.ru_maxrss) / 1024.0};
}

// "key=value" at the ends; an end that is excluded is approached.
void add_ends(const Field& field, std::vector<std::string>& settings) {
  const auto add = [&](const std::string& text) { settings.push_back(field.key + "=" + text); };
  const auto ends = [&](const Range& range) {
    add(range.above_low ? "1e-300" : shortest_decimal(range.low, 0));
    if (range.above_low) add("1e-6");
    add(shortest_decimal(range.high, 0));
  };
  if (const auto* n = std::get_if<NumberField>(&field.value)) ends(n->range);
  if (const auto* n = std::get_if<OptionalNumberField>(&field.value)) ends(n->range);
  if (const auto* i = std::get_if<IntegerField>(&field.value)) {
    add(std::to_string(i->low));
    add(std::to_string(i->high));
  }
}

std::vector<std::string> all_ends() {
  Config config;
  std::vector<std::string> settings;
  for (const Field& field : fields(config)) {
    if (!field.key.starts_with("plant.tissue.")) add_ends(field, settings);
  }
  for (const std::string name : {"RPE", "choroid"}) {
    Layer layer;
    for (const Field& field : layer_fields(layer, "tissue.layers." + name)) {
      add_ends(field, settings);
    }
  }
  return settings;
}

// A short treatment on a coarse grid, unless just these are at their ends.
TEST(Ranges, TheProgramAnswersAtBothEndsOfEveryNumber) {
  const TemporaryFolder folder;
  int number = 0;
  for (const std::string& setting : all_ends()) {
    std::vector<std::string> arguments = {"simulate",
                                          "--out",
                                          folder.file("run" + std::to_string(++number)),
                                          "--set",
                                          "grid.min_cells=4000",
                                          "--set",
                                          "run.duration_ms=100",
                                          "--set",
                                          setting};
    const Usage usage = run(folder, arguments);
    EXPECT_LE(usage.exit_code, 2) << setting;
    EXPECT_LT(usage.seconds, 50.0) << setting;  // of processor time: no run without end
    EXPECT_LT(usage.megabytes, 1000.0) << setting;
  }
}

}  // namespace
}  // namespace photocoag
