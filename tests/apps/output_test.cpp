// What the program leaves behind where its output cannot go on: full and closed streams, links,
// limits, others that write at the same time.
#include <gtest/gtest.h>

#include <future>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kCoarse = " --set grid.min_cells=2000 --set run.duration_ms=20";
// What the shell does with the program and its arguments.
std::string in_shell(const std::string& what) { return "sh -c '" + what + "'"; }
const std::string kInto = "exec \"$0\" \"$@\" ";

TEST(Output, AFullStandardOutputIsFoundOut) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out run" + kCoarse).exit_code, 0);
  ASSERT_EQ(sandbox.run("calibrate --example heating.csv").exit_code, 0);
  for (const std::string& command :
       {"boundaries" + kCoarse, std::string("config"), std::string("--help"),
        std::string("treat --help"), std::string("--version"), std::string("replay run"),
        std::string("convert run --csv -"), std::string("convert run --csv /dev/stdout"),
        "response --model full --power 1 --times 0.001 --csv -" + kCoarse,
        "discretizations" + kCoarse, "reduce --out -" + kCoarse,
        "estimation --seeds 1 --csv -" + kCoarse, "spots --count 1" + kCoarse,
        std::string("doctor"), std::string("latency --seconds 0.02"),
        std::string("calibrate heating.csv"),
        "sweep --vary control.horizon=2 --out sweep" + kCoarse}) {
    const ProgramResult full = sandbox.run(command, in_shell(kInto + ">/dev/full"));
    // Where the file is standard output by its own name, it is a file that cannot be written.
    const int expected = command.find("/dev/stdout") != std::string::npos ? 2 : 1;
    EXPECT_EQ(full.exit_code, expected) << command << "\n" << full.err;
    EXPECT_TRUE(full.err.find("not all output could be written") != std::string::npos ||
                full.err.find("No space left") != std::string::npos)
        << command << "\n"
        << full.err;
  }
  EXPECT_EQ(sandbox.run("config", in_shell(kInto + ">&-")).exit_code, 1);
  EXPECT_EQ(sandbox.run("config").exit_code, 0);
}

TEST(Output, NothingThatIsQuotedCommandsTheTerminal) {
  const Sandbox sandbox;
  const std::string clear = "\x1b[2J";
  const std::string eight_bits = "\xc2\x9b";
  const ProgramResult run = sandbox.run("compare '" + clear + "x" + eight_bits + "2J\xc3\xa9'");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.err.find(clear), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find(eight_bits), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("\\x1b[2Jx"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("\xc3\xa9"), std::string::npos) << "letters stay";
}

TEST(Output, ATerminalThatHasGoneChangesNothingInTheRun) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out usual" + kCoarse).exit_code, 0);
  const std::string expected = read_all(sandbox.path("usual/run.csv"));
  const std::vector<std::pair<std::string, std::string>> ways = {
      {"full", in_shell(kInto + "2>/dev/full")},
      {"gone", in_shell("(\"$0\" \"$@\" 2>&1; echo $? >code) | true; exit $(cat code)")}};
  for (const auto& [name, way] : ways) {
    for (const std::string command : {"simulate", "treat", "treat --device eye"}) {
      const std::string out = name + std::to_string(command.size());
      const ProgramResult run = sandbox.run(command + " --out " + out + kCoarse, way);
      if (command == "treat --device eye" && run.exit_code == 3) continue;  // a busy machine's eye
      EXPECT_EQ(run.exit_code, 1) << command << " " << name;
      for (const char* file : {"run.csv", "summary.json", "report.html"}) {
        EXPECT_TRUE(fs::exists(sandbox.path(out) / file)) << command << " " << name << " " << file;
      }
      if (command != "simulate") continue;
      EXPECT_EQ(read_all(sandbox.path(out) / "run.csv"), expected);
    }
  }
  // Asked for by the caller: no failure, and the next file that is opened is not standard error.
  const ProgramResult closed =
      sandbox.run("simulate --out closed" + kCoarse, in_shell(kInto + "2>&-"));
  EXPECT_EQ(closed.exit_code, 0);
  EXPECT_EQ(read_all(sandbox.path("closed/run.csv")), expected);
}

TEST(Output, AFileSizeLimitIsADiskThatIsFull) {
  const Sandbox sandbox;
  const ProgramResult run = sandbox.run(
      "treat --out run --set run.duration_ms=400 --set plant.model=reduced "
      "--set grid.min_cells=2000",
      "prlimit --fsize=40000:40000");  // bytes: the log has 170,000
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE(run.err.find("ALARM     the log is not complete"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("File too large"), std::string::npos) << run.err;
  ASSERT_EQ(sandbox.run("convert run --recover").exit_code, 0);
  EXPECT_GT(Json::parse(read_all(sandbox.path("run/summary.json")))["log"]["dropped"], 0);
}

TEST(Output, LinksPipesAndDevicesStayWhatTheyAre) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out run" + kCoarse).exit_code, 0);
  const std::string csv = read_all(sandbox.path("run/run.csv"));
  for (const char* kind : {"--csv", "--hdf5", "--mat"}) {
    write_all(sandbox.path("real"), "old");
    fs::remove(sandbox.path("link"));
    fs::create_symlink("real", sandbox.path("link"));
    ASSERT_EQ(sandbox.run("convert run " + std::string(kind) + " link").exit_code, 0);
    EXPECT_TRUE(fs::is_symlink(sandbox.path("link"))) << kind;
    EXPECT_GT(fs::file_size(sandbox.path("real")), 1000U) << kind;
    const ProgramResult out = sandbox.run("convert run " + std::string(kind) + " /dev/stdout");
    EXPECT_EQ(out.exit_code, 0) << out.err;
    EXPECT_EQ(out.out, read_all(sandbox.path("real"))) << kind;
  }
  const ProgramResult piped =
      sandbox.run("convert run --csv pipe", in_shell("mkfifo pipe; cat pipe >seen & \"$0\" \"$@\" "
                                                     "&& wait"));
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(read_all(sandbox.path("seen")), csv);
  EXPECT_TRUE(fs::is_fifo(sandbox.path("pipe")));
}

TEST(Output, RunsThatBeginTogetherGetFoldersOfTheirOwn) {
  const Sandbox sandbox;
  const auto all_at_once = [&](int count, const std::string& command) {
    return sandbox.run(command, in_shell("for i in $(seq " + std::to_string(count) +
                                         "); do \"$0\" \"$@\" 2>/dev/null & pids=\"$pids $!\"; "
                                         "done; good=0; for p in $pids; do wait $p && "
                                         "good=$((good+1)); done; exit $good"));
  };
  EXPECT_EQ(all_at_once(6, "simulate" + kCoarse).exit_code, 6);
  int folders = 0;
  for (const auto& entry : fs::directory_iterator(sandbox.path("runs"))) {
    EXPECT_TRUE(fs::exists(entry.path() / "report.html")) << entry.path();
    ++folders;
  }
  EXPECT_EQ(folders, 6);
  for (const bool empty : {false, true}) {
    const std::string out = empty ? "there" : "new";
    if (empty) fs::create_directory(sandbox.path(out));
    EXPECT_EQ(all_at_once(3, "simulate --out " + out + kCoarse).exit_code, 1) << out;
    EXPECT_TRUE(fs::exists(sandbox.path(out) / "report.html"));
  }
}

}  // namespace
}  // namespace photocoag::testing
