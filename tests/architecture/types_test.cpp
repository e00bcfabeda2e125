// Two headers that define a type of the same name, and the linker takes the functions of one for
// those of the other.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <string>

namespace photocoag {
namespace {

namespace fs = std::filesystem;

TEST(Types, AreDefinedInOneHeader) {
  const fs::path root = PHOTOCOAG_SOURCE_DIR;
  const std::regex definition("(?:class|struct|enum|enum class) (\\w+)(?: final)?(?: :.*)? \\{.*");
  std::map<std::string, fs::path> where;
  for (const char* folder : {"src/photocoag", "apps", "python/src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".hpp") continue;
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        std::smatch type;
        if (!std::regex_match(line, type, definition)) continue;
        const auto [before, first] = where.emplace(type[1], entry.path());
        EXPECT_TRUE(first || before->second == entry.path())
            << type[1] << " of " << entry.path() << " and of " << before->second;
      }
    }
  }
  EXPECT_GT(where.size(), 400U);
}

}  // namespace
}  // namespace photocoag
