// The figures in documents are what the commands that they come from say today.
#include "slow/document_figures.hpp"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "docs/documents.hpp"
#include "photocoag/core/process.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

struct Ran {
  TemporaryFolder folder;
  int exit_code = -1;
  std::string said;  // standard output, then standard error
};

/// Runs a command once, in a folder with the shipped configurations; all share one model cache.
const Ran& run(const std::string& command) {
  static std::map<std::string, Ran> done;
  static const TemporaryFolder cache;
  const auto [at, is_new] = done.try_emplace(command);
  Ran& ran = at->second;
  if (!is_new) return ran;
  for (const char* name : {"configs", "studies", "examples"}) {
    fs::create_directory_symlink(source_folder() / name, ran.folder.path() / name);
  }
  const ProgramResult result =
      run_program({"sh", "-c",
                   "cd \"$1\" && XDG_CACHE_HOME=\"$2\" && export XDG_CACHE_HOME && "
                   "photocoag() { '" PHOTOCOAG_PROGRAM "' \"$@\"; } && photocoag " +
                       command,
                   "sh", ran.folder.path().string(), cache.path().string()},
                  {.patience = 1200.0});
  ran.exit_code = result.exit_code;
  ran.said = result.output + result.errors;
  return ran;
}

std::string with_blanks(const std::string& text) {
  return std::regex_replace(text, std::regex(R"(\s+)"), " ");
}

double csv_cell(const fs::path& file, std::size_t row, const std::string& column) {
  std::istringstream lines(text_of(file));
  std::string line;
  std::getline(lines, line);
  const auto cells = [](const std::string& text) {
    std::vector<std::string> found;
    std::istringstream stream(text);
    for (std::string cell; std::getline(stream, cell, ',');) found.push_back(cell);
    return found;
  };
  const std::vector<std::string> names = cells(line);
  for (std::size_t k = 0; k <= row; ++k) std::getline(lines, line);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == column) return std::stod(cells(line).at(i));
  }
  throw std::runtime_error("no column " + column + " in " + file.string());
}

double claims_with(const nlohmann::json& claims, const std::string& which) {
  return static_cast<double>(std::count_if(claims.begin(), claims.end(), [&](const auto& claim) {
    if (claim["study"] == "computation-times") return false;  // the machine's
    return which == "count" || claim["whose"] == which || claim["verdict"] == which;
  }));
}

double measured_in(const nlohmann::json& claims, const std::string& study, const std::string& term,
                   const std::string& end) {
  for (const auto& claim : claims) {
    if (claim["study"] != study) continue;
    for (const auto& one : claim["measured"]) {
      if (one["term"] != term) continue;
      return (end.empty() ? one["value"] : one["interval_95"][end == "low" ? 0 : 1])
          .template get<double>();
    }
  }
  throw std::runtime_error("no claim of " + study + " has " + term);
}

double value_of(const Source& source, const Ran& ran) {
  const fs::path out = ran.folder.path() / "out";
  std::smatch match;
  const auto claims = [&out] {
    return nlohmann::json::parse(text_of(out / "claims.json"))["claims"];
  };
  if (source.from.starts_with("claims ")) return claims_with(claims(), source.from.substr(7));
  if (std::regex_match(source.from, match,
                       std::regex(R"(([a-z0-9-]+): ([a-z]+\(.*?\))(?:, (low|high))?)"))) {
    return source.times * measured_in(claims(), match[1], match[2], match[3]);
  }
  if (source.from.starts_with('/')) {
    const auto json = nlohmann::json::parse(text_of(out / "summary.json"));
    return source.times * json.at(nlohmann::json::json_pointer(source.from)).template get<double>();
  }
  if (std::regex_match(source.from, match, std::regex(R"((\S+\.csv) (\d+) (\S+))"))) {
    return source.times * csv_cell(out / match[1].str(), std::stoul(match[2]), match[3]);
  }
  if (!std::regex_search(ran.said, match, std::regex(source.from))) {
    throw std::runtime_error("nothing printed matches " + source.from + " in\n" + ran.said);
  }
  return source.times * std::stod(match[1]);
}

/// Half a unit of the last digit, with room for the rounding of decimals to doubles.
void expect_rounds_to(const std::string& figure, double value) {
  const std::string number = std::regex_replace(figure, std::regex("−"), "-");
  const std::size_t point = number.find('.');
  const auto decimals =
      static_cast<int>(point == std::string::npos ? 0 : number.size() - point - 1);
  const double unit = std::pow(10.0, -decimals);
  EXPECT_LE(std::abs(value - std::stod(number)), 0.5 * unit * (1.0 + 1e-6))
      << "quoted " << figure << ", now " << value;
}

TEST(DocumentFigures, AreWhatTheirCommandsSay) {
  for (const Figures& figure : figures()) {
    SCOPED_TRACE(figure.document + ": " + figure.sentence);
    const std::string plain = std::regex_replace(figure.sentence, std::regex("[{}]"), "");
    EXPECT_NE(with_blanks(text_of(source_folder() / figure.document)).find(plain),
              std::string::npos)
        << "the document no longer says this";
    std::string command = figure.command;
    if (std::regex_search(command, std::regex("^(simulate|sweep|discretizations|reproduce)"))) {
      command += " --out out";
    }
    const Ran& ran = run(command);
    ASSERT_LE(ran.exit_code, 1) << command << "\n" << ran.said;
    const std::regex braces(R"(\{([^}]*)\})");
    std::sregex_iterator match(figure.sentence.begin(), figure.sentence.end(), braces);
    for (const Source& source : figure.sources) {
      ASSERT_NE(match, std::sregex_iterator());
      expect_rounds_to((*match++)[1], value_of(source, ran));
    }
    EXPECT_EQ(match, std::sregex_iterator()) << "a figure without a source";
  }
}

/// Pairs of a ```sh block and the ```text block right after it.
std::vector<std::pair<std::string, std::string>> examples(const std::string& document) {
  std::vector<std::pair<std::string, std::string>> found;
  const std::regex pair("```sh\n([^`]*)```\n\n```text\n([^`]*)```");
  for (std::sregex_iterator match(document.begin(), document.end(), pair), end; match != end;
       ++match) {
    found.emplace_back((*match)[1], (*match)[2]);
  }
  return found;
}

std::vector<std::string> words(const std::string& line) {
  std::istringstream stream(std::regex_replace(line, std::regex(","), " , "));
  return {std::istream_iterator<std::string>(stream), {}};
}

/// Word by word; numbers to 1e-9 of their value, which is more than other processors differ by.
bool same_line(const std::string& quoted, const std::string& printed) {
  const std::vector<std::string> left = words(quoted);
  const std::vector<std::string> right = words(printed);
  const auto same = [](const std::string& a, const std::string& b) {
    if (a == b) return true;
    char* end_a = nullptr;
    char* end_b = nullptr;
    const double x = std::strtod(a.c_str(), &end_a);
    const double y = std::strtod(b.c_str(), &end_b);
    return *end_a == 0 && *end_b == 0 && std::abs(x - y) <= 1e-9 * std::abs(x);
  };
  return std::equal(left.begin(), left.end(), right.begin(), right.end(), same);
}

TEST(DocumentFigures, PrintedExamplesAreWhatIsPrinted) {
  // What a clock measures is of one machine and one day, and says so where it stands.
  const std::regex timed(R"(\./photocoag (bench|faults --kills|latency|doctor|treat) )");
  std::set<std::string> checked;
  for (const fs::path& file : documents()) {
    for (const auto& [commands, output] : examples(text_of(file))) {
      if (std::regex_search(commands + ' ', timed)) continue;
      SCOPED_TRACE(file.string() + ": " + commands);
      const std::string script =
          std::regex_replace(commands, std::regex(R"((^|\n)\./photocoag )"), "$1photocoag ");
      const Ran& ran = run(script.substr(script.find(' ') + 1));
      ASSERT_LE(ran.exit_code, 1) << ran.said;
      std::istringstream printed(ran.said);
      std::istringstream quoted(output);
      for (std::string line, now; std::getline(quoted, line);) {
        if (line.find("…") != std::string::npos) continue;
        bool found = false;
        while (!found && std::getline(printed, now)) found = same_line(line, now);
        EXPECT_TRUE(found) << "not printed, or not after the lines before it: " << line << "\n"
                           << ran.said;
        if (!found) break;
      }
      checked.insert(commands);
    }
  }
  EXPECT_GE(checked.size(), 5U) << "the examples are no longer found";
}

TEST(DocumentFigures, AWrongDigitIsSeen) {
  EXPECT_NONFATAL_FAILURE(expect_rounds_to("30.18", 30.1749), "quoted 30.18");
  expect_rounds_to("30.18", 30.1754);
  expect_rounds_to("−11.8", -11.83);
  EXPECT_FALSE(same_line("front 0.40 4.12", "front 0.40 4.13"));
  EXPECT_TRUE(same_line("0.001,5.256547411641051", "0.001,5.256547411641052"));
  const auto found = examples("```sh\na\n```\n\n```text\nb\n```\n");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0], (std::pair<std::string, std::string>{"a\n", "b\n"}));
}

}  // namespace
}  // namespace photocoag::testing
