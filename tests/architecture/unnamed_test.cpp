// A quick build compiles files of a folder together (cmake/compile.cmake): what two of them call by
// the same name in their unnamed namespaces would not compile, or, an overload, be called in place
// of the other.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace photocoag {
namespace {

namespace fs = std::filesystem;

// Types, functions and constants; an alias may stand twice.
std::set<std::string> unnamed_names(const fs::path& source) {
  static const std::regex type("(?:class|struct|enum class|enum) (\\w+).*");
  static const std::regex other(".*?\\b(\\w+) ?(?:\\(|=|\\{|\\[|;).*");
  std::set<std::string> names;
  std::ifstream file(source);
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line == "namespace {") inside = true;
    if (line == "}  // namespace") inside = false;
    if (!inside || line.empty() || std::string(" }/#").find(line[0]) != std::string::npos) continue;
    line = std::regex_replace(line, std::regex("\\[\\[\\w+\\]\\] |alignas\\(\\w+\\) "), "");
    if (std::regex_match(line, std::regex("(using|namespace|template|static_assert)\\b.*")))
      continue;
    std::smatch name;
    if (std::regex_match(line, name, type) || std::regex_match(line, name, other)) {
      names.insert(name[1]);
    }
  }
  return names;
}

TEST(UnnamedNamespaces, OfFilesCompiledTogetherHoldEachNameOnce) {
  std::ifstream groups(PHOTOCOAG_COMPILED_TOGETHER);
  std::size_t files = 0;
  std::size_t names = 0;
  for (std::string group; std::getline(groups, group);) {
    std::map<std::string, std::string> where;
    std::istringstream list(group);
    for (std::string file; std::getline(list, file, ';'); ++files) {
      for (const std::string& name : unnamed_names(file)) {
        const auto [before, first] = where.emplace(name, file);
        ++names;
        EXPECT_TRUE(first) << name << " of " << file << " and of " << before->second;
      }
    }
  }
  EXPECT_GT(files, 150U);
  EXPECT_GT(names, 500U);
}

}  // namespace
}  // namespace photocoag
