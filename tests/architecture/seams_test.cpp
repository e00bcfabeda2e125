// What CONTRIBUTING.md says that a change touches: a column, a device and a command each have one
// place, and no second list has to be kept beside it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace photocoag {
namespace {

namespace fs = std::filesystem;

// Of src and apps, by name from the root; comments left out.
const std::map<std::string, std::string>& sources() {
  static const std::map<std::string, std::string> all = [] {
    const fs::path root = PHOTOCOAG_SOURCE_DIR;
    std::map<std::string, std::string> read;
    for (const char* folder : {"src/photocoag", "apps"}) {
      for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
        const std::string extension = entry.path().extension();
        if (extension != ".cpp" && extension != ".hpp") continue;
        std::ifstream file(entry.path());
        std::string& text = read[fs::relative(entry.path(), root).string()];
        for (std::string line; std::getline(file, line);) {
          text += line.substr(0, line.find("//")) + "\n";
        }
      }
    }
    return read;
  }();
  return all;
}

std::set<std::string> found_in(const std::string& text, const std::regex& pattern) {
  std::set<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    found.insert((*match)[1]);
  }
  return found;
}

// Who names some columns wants just these (a replay, an FMU's outputs); a list of most is a second
// table.
TEST(Seams, TheCyclesColumnsAreListedOnce) {
  const std::string table = "src/photocoag/log/fields.cpp";
  const std::set<std::string> columns =
      found_in(sources().at(table), std::regex(R"re(>\(\s*"([A-Za-z_0-9]+)")re"));
  ASSERT_GT(columns.size(), 50U);
  // What the console's page shows of a cycle, and what the report's figures draw.
  const std::set<std::string> choices = {"src/photocoag/console/messages.cpp",
                                         "src/photocoag/report/run_log.cpp"};
  for (const auto& [name, text] : sources()) {
    if (name == table || choices.contains(name)) continue;
    std::size_t named = 0;
    for (const std::string& column : columns) {
      named += text.find('"' + column + '"') != std::string::npos ? 1 : 0;
    }
    EXPECT_LE(named, 6U) << name;
  }
  for (const std::string& name : choices) {
    EXPECT_LT(found_in(sources().at(name), std::regex(R"re("([a-z_]+_[A-Za-z]+)")re")).size(),
              columns.size() / 2)
        << name << " lists most of them";
  }
}

TEST(Seams, ADeviceIsKnownWhereItIsOpened) {
  std::size_t devices = 0;
  for (const auto& [header, declared] : sources()) {
    const std::regex type(R"((?:class|struct) (\w+Device)\b[^;]*\{)");
    if (!header.starts_with("src/photocoag/rt/") || !header.ends_with("_device.hpp")) continue;
    for (const std::string& device : found_in(declared, type)) {
      ++devices;
      const std::string own = header.substr(0, header.rfind('.'));
      for (const auto& [name, text] : sources()) {
        if (name.starts_with(own) || name.starts_with("src/photocoag/run/open_device.")) continue;
        EXPECT_FALSE(std::regex_search(text, std::regex("\\b" + device + "\\b")))
            << name << " knows " << device;
      }
    }
  }
  EXPECT_GE(devices, 3U);
}

TEST(Seams, ACommandIsOneFile) {
  std::map<std::string, std::string> files;  // by command
  for (const auto& [name, text] : sources()) {
    const std::set<std::string> commands =
        found_in(text, std::regex(R"re(const Command k\w+\(\s*"([a-z-]+)")re"));
    EXPECT_LE(commands.size(), name == "apps/treat.cpp" ? 2U : 1U) << name;
    for (const std::string& command : commands) {
      EXPECT_TRUE(files.emplace(command, name).second) << command << " is registered twice";
    }
  }
  EXPECT_GT(files.size(), 25U);
}

}  // namespace
}  // namespace photocoag
