// Includes go one way: each folder of src/photocoag may include only what modules.txt gives it. The
// libraries that run next to the laser (online, rt) must not know the offline ones.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct Module {
  std::string library;
  std::set<std::string> includes;
};

// src/photocoag/modules.txt, by folder.
std::map<std::string, Module> read_modules() {
  std::ifstream file(fs::path(PHOTOCOAG_SOURCE_DIR) / "src/photocoag/modules.txt");
  std::map<std::string, Module> modules;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream words(line);
    std::string folder;
    Module module;
    words >> folder >> module.library;
    for (std::string word; words >> word;) module.includes.insert(word);
    if (!modules.emplace(folder, module).second) ADD_FAILURE() << folder << " stands there twice";
  }
  return modules;
}

const std::map<std::string, Module>& modules() {
  static const std::map<std::string, Module> read = read_modules();
  return read;
}

const std::set<std::string>& allowed_in(const std::string& folder) {
  return modules().at(folder).includes;
}

TEST(Includes, EveryFolderIncludesOnlyWhatTheTableAllows) {
  const std::regex include("^\\s*#include \"([^\"]+)\"");
  std::set<std::string> seen;
  const fs::path root = fs::path(PHOTOCOAG_SOURCE_DIR) / "src" / "photocoag";
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file()) continue;
    if (entry.path().parent_path() == root) continue;  // modules.txt
    const std::string folder = fs::relative(entry.path(), root).begin()->string();
    seen.insert(folder);
    ASSERT_TRUE(modules().contains(folder)) << folder << " has no row in modules.txt";
    std::ifstream file(entry.path());
    std::string line;
    std::smatch match;
    while (std::getline(file, line)) {
      if (!std::regex_search(line, match, include)) continue;
      const std::string path = match[1];
      ASSERT_EQ(path.rfind("photocoag/", 0), 0U) << entry.path() << ": " << path;
      const std::string target = path.substr(10, path.find('/', 10) - 10);
      EXPECT_TRUE(target == folder || allowed_in(folder).contains(target))
          << entry.path() << " must not include " << path;
    }
  }
  EXPECT_GT(seen.size(), 30U);
  for (const auto& [folder, module] : modules()) {
    EXPECT_TRUE(seen.contains(folder)) << folder << " is gone";
  }
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
  std::set<std::string> reached = allowed_in("safety");
  for (std::size_t round = 0; round < modules().size(); ++round) {
    const std::set<std::string> before = reached;
    for (const std::string& folder : before) reached.merge(std::set(allowed_in(folder)));
  }
  for (const std::string other : {"estimation", "mpc", "qp", "rom", "loop"}) {
    EXPECT_FALSE(reached.contains(other)) << other;
  }
}

TEST(Includes, TheTableHasNoCycle) {
  // Remove folders whose includes are all removed; what remains is a cycle.
  std::set<std::string> done;
  for (std::size_t round = 0; round < modules().size(); ++round) {
    for (const auto& [folder, module] : modules()) {
      bool ready = true;
      for (const std::string& target : module.includes) ready = ready && done.contains(target);
      if (ready) done.insert(folder);
    }
  }
  EXPECT_EQ(done.size(), modules().size());
}

std::set<std::string> folders_of(const std::set<std::string>& libraries) {
  std::set<std::string> folders;
  for (const auto& [folder, module] : modules()) {
    if (libraries.contains(module.library)) folders.insert(folder);
  }
  return folders;
}

TEST(Includes, OnlineKnowsNoOfflineFolder) {
  const std::set<std::string> online =
      folders_of({"photocoag_base", "photocoag_online", "photocoag_rt"});
  EXPECT_GT(online.size(), 9U);
  for (const std::string& folder : online) {
    for (const std::string& other : allowed_in(folder)) {
      EXPECT_TRUE(online.contains(other)) << folder << " includes " << other;
    }
  }
}

TEST(Includes, OnlyRigsKnowRigs) {
  const std::set<std::string> rigs = folders_of({"photocoag_rigs"});
  EXPECT_EQ(rigs.size(), 3U);
  for (const auto& [folder, module] : modules()) {
    if (rigs.contains(folder)) continue;
    for (const std::string& other : module.includes) {
      EXPECT_FALSE(rigs.contains(other)) << folder << " includes " << other;
    }
  }
}

std::set<std::string> words_of(const std::string& text) {
  const std::regex word("[a-z_]+");
  std::set<std::string> words;
  for (std::sregex_iterator match(text.begin(), text.end(), word), end; match != end; ++match) {
    words.insert(match->str());
  }
  return words;
}

// docs/architecture.md: a table of libraries and one of folders.
TEST(Includes, TheDocumentHasTheSameTables) {
  std::ifstream file(fs::path(PHOTOCOAG_SOURCE_DIR) / "docs/architecture.md");
  const std::regex library("^\\| `(photocoag_[a-z_]+)`[^|]*\\| ([^|]*)\\|.*");
  const std::regex folder("^\\| ([a-z_]+) \\| ([^|]*) \\| [^|]*\\|$");
  std::map<std::string, std::set<std::string>> libraries;
  std::set<std::string> seen;
  std::smatch match;
  for (std::string line; std::getline(file, line);) {
    if (std::regex_match(line, match, library)) {
      const std::string listed = match[2].str();
      libraries[match[1]] = words_of(listed.substr(0, listed.find(':')));
    } else if (std::regex_match(line, match, folder) && modules().contains(match[1])) {
      seen.insert(match[1]);
      EXPECT_EQ(words_of(match[2]), allowed_in(match[1])) << match[1];
    }
  }
  for (const auto& [name, module] : modules()) {
    EXPECT_TRUE(seen.contains(name)) << name << " has no row in the document";
    for (const std::string& one : words_of(module.library)) {
      EXPECT_TRUE(libraries[one].contains(name)) << name << " is not listed with " << one;
      libraries[one].erase(name);
    }
  }
  for (const auto& [name, left] : libraries) {
    EXPECT_TRUE(left.empty()) << name << " is said to hold " << *left.begin();
  }
}

}  // namespace
}  // namespace photocoag
