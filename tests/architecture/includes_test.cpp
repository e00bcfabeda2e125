// Includes go one way: each folder of src/photocoag may include only the folders listed for it. The
// libraries that run next to the laser (online, rt) must not know the offline ones.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace photocoag {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>> kAllowed = {
    {"core", {}},
    {"tissue", {"core"}},
    {"rom", {"core", "tissue"}},
    {"fom", {"core", "tissue"}},
    {"mor", {"core", "tissue", "rom", "fom"}},
    // Shares nothing with the models that are held against it.
    {"crosscheck", {"core", "tissue"}},
    {"estimation", {"core", "rom"}},
    {"qp", {"core"}},
    {"mpc", {"core", "rom", "qp"}},
    {"osqp", {"core", "rom", "qp", "mpc"}},
    {"certify", {"core", "rom", "qp", "mpc"}},
    {"benchmark", {"core", "rom", "estimation", "mpc", "qp", "loop"}},
    {"study",
     {"core", "rom", "fom", "estimation", "mpc", "loop", "config", "run", "page", "report",
      "osqp"}},
    {"campaign",
     {"core", "tissue", "rom", "fom", "mpc", "loop", "config", "run", "run_files", "page",
      "study"}},
    {"session",
     {"core", "config", "estimation", "rt", "run", "report", "page", "run_files", "campaign"}},
    {"device", {}},
    {"photoacoustics", {"core"}},
    // The supervisor shares nothing with what it supervises.
    {"safety", {"core", "device", "tissue"}},
    {"loop", {"core", "rom", "estimation", "mpc", "qp", "device", "safety"}},
    {"rt", {"core", "loop", "device", "safety", "photoacoustics"}},
    {"eye", {"core", "tissue", "fom", "photoacoustics", "rt"}},
    {"config",
     {"core", "tissue", "rom", "fom", "mor", "estimation", "mpc", "photoacoustics", "safety"}},
    {"run",
     {"core", "tissue", "fom", "mor", "rom", "crosscheck", "estimation", "mpc", "qp", "device",
      "safety", "loop", "photoacoustics", "eye", "rt", "log", "config", "osqp"}},
    {"log", {"core", "loop", "rt"}},
    {"realtime_check", {"core", "rt"}},
    {"run_files", {"core", "config", "loop", "log", "run"}},
    {"console", {"core", "rom", "safety", "rt", "log", "config", "run", "realtime_check"}},
    {"page", {"core"}},
    {"report", {"core", "page"}},
    {"export", {"core", "rom", "estimation", "mpc", "loop"}},
    {"fmu", {"core", "rom", "fom", "device", "safety", "loop", "config", "run", "page", "export"}},
    // The injector shares the device interface with the supervisor, nothing else.
    {"faults", {"device", "loop"}},
    {"fault_table",
     {"core", "rom", "fom", "mor", "mpc", "qp", "device", "safety", "loop", "log", "rt", "faults",
      "config", "run"}},
};

TEST(Includes, EveryFolderIncludesOnlyWhatTheTableAllows) {
  const std::regex include("^\\s*#include \"([^\"]+)\"");
  std::set<std::string> seen;
  const fs::path root = fs::path(PHOTOCOAG_SOURCE_DIR) / "src" / "photocoag";
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file()) continue;
    const std::string folder = fs::relative(entry.path(), root).begin()->string();
    seen.insert(folder);
    ASSERT_TRUE(kAllowed.contains(folder)) << folder << " has no row in the table";
    std::ifstream file(entry.path());
    std::string line;
    std::smatch match;
    while (std::getline(file, line)) {
      if (!std::regex_search(line, match, include)) continue;
      const std::string path = match[1];
      ASSERT_EQ(path.rfind("photocoag/", 0), 0U) << entry.path() << ": " << path;
      const std::string target = path.substr(10, path.find('/', 10) - 10);
      EXPECT_TRUE(target == folder || kAllowed.at(folder).contains(target))
          << entry.path() << " must not include " << path;
    }
  }
  for (const auto& [folder, allowed] : kAllowed)
    EXPECT_TRUE(seen.contains(folder)) << folder << " is gone";
}

// core/types.hpp refuses a program whose Eigen is laid out otherwise: no header with Eigen is
// without.
TEST(Includes, WhatUsesEigenIncludesTheCheckOfItsLayout) {
  const fs::path sources = fs::path(PHOTOCOAG_SOURCE_DIR) / "src";
  const fs::path check = sources / "photocoag/core/types.hpp";
  const std::regex include("(?:^|\\n)\\s*#include \"(photocoag/[^\"]+)\"");
  const auto text = [](const fs::path& file) {
    std::ifstream stream(file);
    return std::string{std::istreambuf_iterator<char>(stream), {}};
  };
  std::size_t headers = 0;
  for (const auto& entry : fs::recursive_directory_iterator(sources)) {
    if (entry.path().extension() != ".hpp") continue;
    if (text(entry.path()).find("#include <Eigen/") == std::string::npos) continue;
    std::set<fs::path> reached = {entry.path()};
    for (std::vector<fs::path> next = {entry.path()}; !next.empty();) {
      const std::string content = text(next.back());
      next.pop_back();
      for (std::sregex_iterator match(content.begin(), content.end(), include), end; match != end;
           ++match) {
        const fs::path file = sources / (*match)[1].str();
        if (reached.insert(file).second) next.push_back(file);
      }
    }
    EXPECT_TRUE(reached.contains(check)) << entry.path();
    ++headers;
  }
  EXPECT_GT(headers, 10U);
}

// Eigen's decompositions cost seconds of compile time per file.
TEST(Includes, OnlyLinearAlgebraCompilesEigensDecompositions) {
  const std::regex include("(?:^|\\n)\\s*#\\s*include\\s*[<\"]((?:unsupported/)?Eigen/[^>\"]*)");
  const std::set<std::string> light = {"Eigen/Core", "Eigen/SparseCore"};
  bool seen = false;
  for (const char* folder : {"src", "apps", "drivers", "examples", "tools"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(PHOTOCOAG_SOURCE_DIR) / folder)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      const std::string name = entry.path().filename();
      const bool home = name.starts_with("linear_algebra") || name == "special_functions.cpp";
      for (std::sregex_iterator match(text.begin(), text.end(), include), end; match != end;
           ++match) {
        const bool heavy = !light.contains((*match)[1]);
        seen = seen || (heavy && home);
        EXPECT_TRUE(!heavy || home)
            << entry.path() << " includes " << (*match)[1] << "; core/linear_algebra.hpp has it";
      }
    }
  }
  EXPECT_TRUE(seen) << "core/linear_algebra*.cpp have moved";
}

TEST(House, NoFindingIsSilencedInTheCode) {
  for (const char* folder : {"src", "apps", "benchmarks", "drivers", "examples", "tools"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(PHOTOCOAG_SOURCE_DIR) / folder)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      EXPECT_EQ(text.find("NOLINT"), std::string::npos) << entry.path();
    }
  }
}

TEST(Includes, TheSupervisorSharesNothingWithWhatItSupervises) {
  // Not even through a detour.
  std::set<std::string> reached = kAllowed.at("safety");
  for (std::size_t round = 0; round < kAllowed.size(); ++round) {
    const std::set<std::string> before = reached;
    for (const std::string& folder : before) reached.merge(std::set(kAllowed.at(folder)));
  }
  for (const std::string other : {"estimation", "mpc", "qp", "rom", "loop"}) {
    EXPECT_FALSE(reached.contains(other)) << other;
  }
}

TEST(Includes, TheTableHasNoCycle) {
  // Remove folders whose includes are all removed; what remains is a cycle.
  std::set<std::string> done;
  for (std::size_t round = 0; round < kAllowed.size(); ++round) {
    for (const auto& [folder, allowed] : kAllowed) {
      bool ready = true;
      for (const std::string& target : allowed) ready = ready && done.contains(target);
      if (ready) done.insert(folder);
    }
  }
  EXPECT_EQ(done.size(), kAllowed.size());
}

TEST(Includes, OnlineKnowsNoOfflineFolder) {
  for (const std::string online : {"core", "tissue", "rom", "estimation", "qp", "mpc", "device",
                                   "safety", "photoacoustics", "loop", "rt"}) {
    for (const std::string offline :
         {"fom", "mor", "config", "run", "report", "benchmark", "osqp", "eye"}) {
      EXPECT_FALSE(kAllowed.at(online).contains(offline)) << online << " includes " << offline;
    }
  }
}

}  // namespace
}  // namespace photocoag
