// Every ./photocoag command line in a document is one that the program takes: the command exists,
// its help lists the options, and the configuration that --config and --set describe is valid. What
// a document's table of commands says of them is what --help says.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "docs/documents.hpp"

namespace photocoag::testing {
namespace {

struct Result {
  int exit_code;
  std::string output;
};

/// `arguments` is shell text; the current folder is the root of the sources.
Result program(const std::string& arguments) {
  const std::string command = "cd '" + source_folder().string() + "' && '" PHOTOCOAG_PROGRAM "' " +
                              arguments + " 2>&1 </dev/null";
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("no shell");
  std::string output;
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, output};
}

/// Shell lines of a document's ```sh blocks that start the program: continued lines joined, what
/// follows the command (comments, pipes, redirections) cut off.
std::vector<std::string> command_lines(const std::string& document) {
  std::vector<std::string> commands;
  std::string joined;
  bool in_quotes = false;
  for (std::string line : lines_of(document, true, "sh")) {
    for (const char c : line) in_quotes ^= c == '\'';
    const bool continued = line.ends_with('\\');
    if (continued) line.pop_back();
    joined += line + " ";
    if (continued || in_quotes) continue;
    const std::size_t start = joined.find("./photocoag ");
    if (start != std::string::npos) {
      std::string command = joined.substr(start + 12);
      bool quoted = false;
      for (std::size_t i = 0; i < command.size(); ++i) {
        quoted ^= command[i] == '\'';
        const bool blank_before = i == 0 || command[i - 1] == ' ';
        const char c = command[i];
        if (!quoted &&
            (c == '|' || c == ';' || c == '>' || c == '&' || (c == '#' && blank_before))) {
          command.resize(i);
        }
      }
      commands.push_back(command);
    }
    joined.clear();
  }
  return commands;
}

/// The --config (of shipped files) and --set options of a command line, as shell text.
std::string configuration_of(const std::string& command) {
  std::string options;
  const std::regex option(
      R"re(--config +configs/\S+|--set +('[^']*'|"[^"]*"|(?:[^\s"']|"[^"]*")+))re");
  for (std::sregex_iterator match(command.begin(), command.end(), option), end; match != end;
       ++match) {
    options += ' ';
    options += match->str();
  }
  return options;
}

/// The table of commands as a document has it, from --help: a row for each group and each command.
std::vector<std::string> table_of_help() {
  std::vector<std::string> rows;
  std::string group;
  std::istringstream help(program("--help").output);
  const std::regex command("  ([a-z][a-z-]*) +(.+)");
  std::smatch match;
  for (std::string line; std::getline(help, line) && line != "Examples:";) {
    if (!line.starts_with(' ') && line.ends_with(':')) group = line.substr(0, line.size() - 1);
    if (!std::regex_match(line, match, command)) continue;
    if (!group.empty()) rows.push_back("| **" + group + "** | |");
    group.clear();
    rows.push_back("| `" + match[1].str() + "` | " + match[2].str() + " |");
  }
  return rows;
}

/// The rows of a document's tables of commands.
std::vector<std::string> command_rows(const std::string& document) {
  std::vector<std::string> rows;
  bool inside = false;
  for (const std::string& line : lines_of(document, false)) {
    inside = line == "| command | does |" || (inside && line.starts_with('|'));
    if (inside) rows.push_back(line);
  }
  std::erase(rows, "| command | does |");
  std::erase(rows, "| --- | --- |");
  return rows;
}

TEST(DocumentedCommands, TablesSayWhatHelpSays) {
  const std::vector<std::string> help = table_of_help();
  EXPECT_EQ(command_rows(text_of(source_folder() / "README.md")), help);
  std::size_t checked = 0;
  for (const auto& file : documents()) {
    for (const std::string& row : command_rows(text_of(file))) {
      EXPECT_NE(std::find(help.begin(), help.end(), row), help.end()) << file << ": " << row;
      ++checked;
    }
  }
  EXPECT_GT(checked, help.size()) << "no table beside README's";
}

TEST(DocumentedCommands, ReadsShellText) {
  const auto commands = command_lines(
      "./photocoag outside\n```sh\n./photocoag a --set 'x=[\n  {y = 1}]' # c\nls\n./photocoag b "
      "\\\n  --set u=v | less\n"
      "```\n```text\n./photocoag output\n```\n");
  ASSERT_EQ(commands.size(), 2U);
  EXPECT_EQ(configuration_of(commands[0]), " --set 'x=[   {y = 1}]'");
  EXPECT_NE(commands[1].find(" --set u=v"), std::string::npos) << commands[1];
  EXPECT_EQ(commands[1].find("less"), std::string::npos);
}

TEST(DocumentedCommands, AreTakenByTheProgram) {
  std::size_t checked = 0;
  for (const auto& file : documents()) {
    for (const std::string& command : command_lines(text_of(file))) {
      SCOPED_TRACE(file.string() + ": ./photocoag " + command);
      const std::string name = command.substr(0, command.find(' '));
      const std::set<std::string> own = {"test", "python", "docs", "build", "package"};
      if (own.contains(name)) continue;  // the script's own
      if (name.rfind("--", 0) == 0) {
        EXPECT_EQ(program(command).exit_code, 0);
        continue;
      }
      const Result help = program(name + " --help");
      ASSERT_EQ(help.exit_code, 0) << help.output;
      // An unknown command with --help gets the program's own help.
      ASSERT_NE(help.output.find("Usage: photocoag " + name + " "), std::string::npos);
      const std::regex option(R"((?:^|\s)(--[a-z][a-z0-9-]*))");
      for (std::sregex_iterator match(command.begin(), command.end(), option), end; match != end;
           ++match) {
        EXPECT_NE(help.output.find((*match)[1].str() + " "), std::string::npos)
            << "no option " << (*match)[1];
      }
      const Result config = program("config" + configuration_of(command));
      EXPECT_EQ(config.exit_code, 0) << config.output;
      ++checked;
    }
  }
  EXPECT_GT(checked, 10U) << "command lines are no longer found";
}

}  // namespace
}  // namespace photocoag::testing
