// What documents and headers refer to is there: equations, tests, files, headings.
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include "docs/documents.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

std::set<int> numbers(const std::string& text, const std::regex& pattern) {
  std::set<int> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    found.insert(std::stoi((*match)[1]));
  }
  return found;
}

TEST(References, EveryEquationCitedInTheSourcesHasItsHeading) {
  const std::set<int> headings = numbers(text_of(source_folder() / "docs" / "equations.md"),
                                         std::regex(R"((?:^|\n)### \(E(\d+)\))"));
  ASSERT_FALSE(headings.empty());
  // Numbered without a gap.
  EXPECT_EQ(*headings.begin(), 1);
  EXPECT_EQ(*headings.rbegin(), static_cast<int>(headings.size()));
  std::set<int> cited;
  for (const auto& entry : fs::recursive_directory_iterator(source_folder() / "src")) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".hpp" && extension != ".cpp") continue;
    for (const int number : numbers(text_of(entry.path()), std::regex(R"(\(E(\d+)\))"))) {
      EXPECT_TRUE(headings.contains(number)) << entry.path() << " cites (E" << number << ")";
      cited.insert(number);
    }
  }
  EXPECT_GE(cited.size(), 10U) << "the pattern no longer finds citations";
  for (const fs::path& file : documents()) {
    for (const int number : numbers(text_of(file), std::regex(R"(\(E(\d+)\))"))) {
      EXPECT_TRUE(headings.contains(number)) << file << " cites (E" << number << ")";
    }
  }
}

// "Code: `mpc/ocp`": a header or source of that name below src/photocoag.
TEST(References, EveryEquationSaysWhereItsCodeIs) {
  const std::string text = text_of(source_folder() / "docs" / "equations.md");
  const std::regex path(R"(`(\w+/\w+)(\.[hc]pp)?`)");
  const fs::path sources = source_folder() / "src" / "photocoag";
  int equations = 0;
  for (std::size_t at = text.find("\n### (E"); at != std::string::npos; ++equations) {
    const std::size_t next = text.find("\n##", at + 1);
    const std::string section = text.substr(at, next - at);
    const std::string name = section.substr(5, section.find('\n', 5) - 5);
    at = text.find("\n### (E", at + 1);
    const std::size_t code = section.find("Code:");
    ASSERT_NE(code, std::string::npos) << name;
    const std::string files = section.substr(code, section.find(".\n", code) - code);
    int named = 0;
    for (std::sregex_iterator file(files.begin(), files.end(), path), end; file != end; ++file) {
      const std::string base = (sources / (*file)[1].str()).string();
      EXPECT_TRUE(fs::exists(base + ".hpp") || fs::exists(base + ".cpp")) << name << ": " << base;
      ++named;
    }
    EXPECT_GT(named, 0) << name;
  }
  EXPECT_GE(equations, 31);
}

TEST(References, EveryTestNamedInADocumentExists) {
  std::set<std::string> tests;
  std::set<std::string> suites;
  const std::regex definition(R"((?:^|\n)(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\))");
  for (const auto& entry : fs::recursive_directory_iterator(source_folder() / "tests")) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = text_of(entry.path());
    for (std::sregex_iterator match(text.begin(), text.end(), definition), end; match != end;
         ++match) {
      tests.insert((*match)[1].str() + "." + (*match)[2].str());
      suites.insert((*match)[1]);
    }
  }
  ASSERT_GT(tests.size(), 100U);
  const std::regex name(R"(`([A-Z]\w+)\.([A-Z]\w+)`)");
  std::size_t named = 0;
  for (const fs::path& file : documents()) {
    const std::string text = text_of(file);
    for (std::sregex_iterator match(text.begin(), text.end(), name), end; match != end; ++match) {
      const std::string suite = (*match)[1];
      const std::string test = suite + "." + (*match)[2].str();
      if (test == "Suite.Name") continue;  // stands for any
      EXPECT_TRUE(tests.contains(test)) << file << " names " << test;
      ++named;
    }
  }
  EXPECT_GT(named, 10U) << "the pattern no longer finds names";
}

/// GitHub's anchor of a heading: lower case, punctuation dropped, blanks as hyphens.
std::string anchor(const std::string& heading) {
  std::string result;
  for (const char c : heading) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '-' || c == '_' || byte >= 0x80) {
      result += static_cast<char>(std::tolower(byte));
    } else if (c == ' ') {
      result += '-';
    }
  }
  return result;
}

std::set<std::string> anchors(const fs::path& document) {
  std::set<std::string> result;
  const std::regex heading(R"(^#{1,6} +(.*?) *$)");
  const std::regex explicit_anchor(R"re(<a id="([^"]+)">)re");
  for (const std::string& line : lines_of(text_of(document), false)) {
    std::smatch match;
    if (std::regex_match(line, match, heading)) result.insert(anchor(match[1]));
    if (std::regex_search(line, match, explicit_anchor)) result.insert(match[1]);
  }
  return result;
}

TEST(References, EveryRelativeLinkResolves) {
  const std::regex link(R"(\]\(([^)\s]+)\)|(?:src|srcset|href)="([^"]+)\")");
  std::size_t links = 0;
  for (const fs::path& file : documents()) {
    for (const std::string& line : lines_of(text_of(file), false)) {
      for (std::sregex_iterator match(line.begin(), line.end(), link), end; match != end; ++match) {
        const std::string target = (*match)[1].matched ? (*match)[1].str() : (*match)[2].str();
        if (target.find("://") != std::string::npos || target.rfind("mailto:", 0) == 0) continue;
        ++links;
        const std::size_t hash = target.find('#');
        const std::string path = target.substr(0, hash);
        const fs::path wanted = path.empty() ? file : file.parent_path() / path;
        ASSERT_TRUE(fs::exists(wanted)) << file << " links to " << target;
        if (hash != std::string::npos && wanted.extension() == ".md") {
          EXPECT_TRUE(anchors(wanted).contains(target.substr(hash + 1)))
              << file << " links to " << target << ": no such heading";
        }
      }
    }
  }
  EXPECT_GT(links, 10U) << "the pattern no longer finds links";
}

}  // namespace
}  // namespace photocoag::testing
