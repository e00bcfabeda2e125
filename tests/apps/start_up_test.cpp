// The program starts with few libraries, and reaches what needs more in its other half.
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <algorithm>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

const fs::path kProgram = PHOTOCOAG_PROGRAM;
const fs::path kFullProgram = kProgram.parent_path() / "photocoag-full";

// What the loader loads.
std::vector<std::string> libraries_of(const fs::path& program) {
  std::vector<std::string> names;
  FILE* said = popen(("LC_ALL=C ldd '" + program.string() + "'").c_str(), "r");
  char line[4096];
  while (said != nullptr && std::fgets(line, sizeof line, said) != nullptr) names.push_back(line);
  EXPECT_TRUE(said != nullptr && pclose(said) == 0);
  return names;
}

bool any_is(const std::vector<std::string>& libraries, const std::string& name) {
  return std::any_of(libraries.begin(), libraries.end(), [&](const std::string& library) {
    return library.find(name) != std::string::npos;
  });
}

// Names of the commands, as --help lists them.
std::vector<std::string> commands_of(const std::string& help) {
  std::vector<std::string> commands;
  std::istringstream lines(help);
  bool options = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.front() != ' ') options = line == "Options:";
    if (line.starts_with("Examples:")) break;
    if (options || !line.starts_with("  ") || line[2] == ' ' || line[2] == '-') continue;
    commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return commands;
}

TEST(StartUp, LoadsNoneOfTheHeavyLibraries) {
  const std::vector<std::string> light = libraries_of(kProgram);
  const std::vector<std::string> full = libraries_of(kFullProgram);
  for (const std::string name : {"libhdf5", "libmatio", "libwebsockets"}) {
    EXPECT_FALSE(any_is(light, name)) << name;
    EXPECT_TRUE(any_is(full, name)) << name;  // else this test sees nothing
  }
  for (const std::string name :
       {"libmpi", "libcurl", "libgnutls", "libkrb5", "libssl", "libhwloc"}) {
    EXPECT_FALSE(any_is(light, name)) << name;
  }
  // Sanitizers bring two; the program of everything had 55.
  EXPECT_LE(light.size(), 16U);
  EXPECT_GT(full.size(), light.size() + 10);
}

TEST(StartUp, EveryCommandOfTheHelpIsThere) {
  const Sandbox sandbox;
  const ProgramResult help = sandbox.run("--help");
  const std::vector<std::string> commands = commands_of(help.out);
  EXPECT_GE(commands.size(), 30U) << help.out;
  for (const std::string name :
       {"treat", "campaign", "session", "console", "convert", "completion"}) {
    EXPECT_NE(std::find(commands.begin(), commands.end(), name), commands.end()) << name;
  }
  for (const std::string& command : commands) {
    const ProgramResult own = sandbox.run(command + " --help");
    EXPECT_EQ(own.exit_code, 0) << command << own.err;
    EXPECT_NE(own.out.find("Usage: photocoag " + command), std::string::npos) << own.out;
    EXPECT_NE(own.out.find("Examples:"), std::string::npos) << command;
    EXPECT_NE(own.out.find("Research software"), std::string::npos) << command;
  }
}

TEST(StartUp, HelpAndVersionAreTheSameInBoth) {
  const Sandbox sandbox;
  const auto same = [&](const std::string& arguments) {
    const std::string light = sandbox.run(arguments).out;
    const std::string out = sandbox.path("full").string();
    const std::string command =
        "'" + kFullProgram.string() + "' " + arguments + " >'" + out + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(light, read_all(out)) << arguments;
    EXPECT_FALSE(light.empty());
  };
  for (const char* arguments : {"--help", "--version", "--version --json", "treat --help"}) {
    same(arguments);
  }
}

// The second run finds the model and the eye's modes in the cache.
TEST(StartUp, WhatIsFoundInTheCacheChangesNoByte) {
  const Sandbox sandbox;
  for (const std::string more : {"--out first", "--out second", "--no-cache --out third"}) {
    const ProgramResult run = sandbox.run("simulate --set run.duration_ms=20 " + more);
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  for (const std::string file : {"run.csv", "field.vtr"}) {
    const std::string first = read_all(sandbox.path("first/" + file));
    EXPECT_FALSE(first.empty());
    EXPECT_EQ(first, read_all(sandbox.path("second/" + file))) << file;
    EXPECT_EQ(first, read_all(sandbox.path("third/" + file))) << file;
  }
}

// As installed, moved anywhere, or beside each other in a build tree.
TEST(StartUp, FindsItsOtherHalfOrSaysWhichFileIsMissing) {
  const Sandbox sandbox;
  const fs::path bin = sandbox.path("a prefix/bin");
  const fs::path libexec = sandbox.path("a prefix/libexec/photocoag");
  fs::create_directories(bin);
  fs::create_directories(libexec);
  fs::copy_file(kProgram, bin / "photocoag");
  const auto run = [&](const std::string& arguments) {
    const std::string said = sandbox.path("said").string();
    const std::string command =
        "'" + (bin / "photocoag").string() + "' " + arguments + " >'" + said + "' 2>&1";
    const int status = std::system(command.c_str());
    return std::make_pair(WEXITSTATUS(status), read_all(said));
  };
  EXPECT_EQ(run("--version").first, 0);
  EXPECT_EQ(run("config").first, 0);
  const auto [code, said] = run("convert --help");
  EXPECT_EQ(code, 2);
  EXPECT_NE(said.find("photocoag-full"), std::string::npos) << said;
  fs::create_symlink(kFullProgram, libexec / "photocoag-full");
  EXPECT_EQ(run("convert --help").first, 0);
  EXPECT_EQ(run("completion man").first, 0);
  // Its arguments arrive as they are, and so does its exit code.
  const auto [bad, refused] = run("campaign 'no such file.toml' --out x");
  EXPECT_EQ(bad, 2);
  EXPECT_NE(refused.find("no such file.toml"), std::string::npos) << refused;
}

}  // namespace
}  // namespace photocoag::testing
