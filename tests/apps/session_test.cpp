// `session` as a user runs it.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "session/sessions.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;

Json json_of(const Sandbox& sandbox, const std::string& file) {
  return Json::parse(read_all(sandbox.path(file)));
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++count;
  return count;
}

TEST(SessionCommand, LeavesARunFolderPerSpotAndOneTableOneRecordOnePage) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"), small_session("learn = true\n"));
  const ProgramResult result = sandbox.run("session s.toml --out s");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* file : {"session.toml", "session.json", "summary.json", "session.h5",
                           "index.html", "session.journal", "spots/001-A/report.html",
                           "spots/002-B/run.csv", "spots/003-C/summary.json"}) {
    EXPECT_TRUE(std::filesystem::exists(sandbox.path("s") / file)) << file;
  }
  const Json session = json_of(sandbox, "s/session.json");
  EXPECT_EQ(session["end"], "complete");
  EXPECT_EQ(session["treated_spots"], 3);
  double energy = 0.0;
  for (const Json& attempt : session["attempt"]) energy += attempt["energy_mJ"].get<double>();
  EXPECT_NEAR(session["energy_mJ"].get<double>(), energy, 1e-9);
  // Each spot is what `simulate` makes of its configuration; what was learnt is in there.
  const std::string config = "s/spots/003-C/config.toml";
  ASSERT_EQ(sandbox.run("simulate --config " + config + " --out again").exit_code, 0);
  EXPECT_EQ(read_all(sandbox.path("again/run.csv")),
            read_all(sandbox.path("s/spots/003-C/run.csv")));
  EXPECT_NE(session["attempt"][2]["prior"], session["attempt"][0]["prior"]);
  // A second time there is nothing to do.
  const std::string journal = read_all(sandbox.path("s/session.journal"));
  EXPECT_EQ(sandbox.run("session s.toml --out s").exit_code, 0);
  EXPECT_EQ(read_all(sandbox.path("s/session.journal")), journal);
  // And with another file nothing may be done.
  write_all(sandbox.path("s.toml"), small_session("learn = false\n"));
  const ProgramResult other = sandbox.run("session s.toml --out s");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("another session"), std::string::npos) << other.err;
}

TEST(SessionCommand, ARepetitionHasAFolderAndNoiseOfItsOwn) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"), small_session());
  ASSERT_EQ(sandbox.run("session s.toml --out s").exit_code, 0);
  EXPECT_EQ(sandbox.run("session s.toml --out s --repeat Z").exit_code, 2);
  ASSERT_EQ(sandbox.run("session s.toml --out s --repeat B").exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(sandbox.path("s/spots/002-B-2/report.html")));
  EXPECT_NE(read_all(sandbox.path("s/spots/002-B-2/run.csv")),
            read_all(sandbox.path("s/spots/002-B/run.csv")));
  EXPECT_EQ(json_of(sandbox, "s/session.json")["attempts"], 4);
}

TEST(SessionCommand, TheOperatorAcceptsRepeatsSkipsAndEnds) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"), small_session());
  write_all(sandbox.path("answers"), "t\nr\nt\na\ns\nx\ne\n");
  const ProgramResult result =
      sandbox.run("session s.toml --out s --ask", "sh -c 'exec \"$0\" \"$@\" < answers'");
  EXPECT_EQ(result.exit_code, 1);
  const Json session = json_of(sandbox, "s/session.json");
  EXPECT_EQ(session["end"], "operator");
  EXPECT_EQ(session["attempts"], 2) << "A, and A again";
  EXPECT_EQ(session["plan"][0]["ending"], "treated");
  EXPECT_EQ(session["plan"][1]["ending"], "skipped");
  EXPECT_EQ(session["plan"][2]["ending"], "planned");
  // Nobody answers: nothing is treated.
  const ProgramResult silent = sandbox.run("session s.toml --out t --ask");
  EXPECT_EQ(silent.exit_code, 1);
  EXPECT_EQ(json_of(sandbox, "t/session.json")["attempts"], 0);
}

TEST(SessionCommand, NoSpotBeginsThatMightExceedALimitOfTheSession) {
  const Sandbox sandbox;
  // A spot may take 2.1 mJ: 20 cycles of 1 ms and one held over, at 0.1 W.
  write_all(sandbox.path("s.toml"), small_session("", "[limits]\nenergy_mJ = 3.0\n"));
  const ProgramResult result = sandbox.run("session s.toml --out s");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("limits.energy_mJ = 3"), std::string::npos) << result.err;
  const Json session = json_of(sandbox, "s/session.json");
  EXPECT_EQ(session["end"], "limit");
  EXPECT_GE(session["attempts"], 1);
  EXPECT_LE(session["energy_mJ"], 3.0);
  write_all(sandbox.path("n.toml"), small_session("", "[limits]\nspots = 2\n"));
  EXPECT_EQ(sandbox.run("session n.toml --out n").exit_code, 1);
  EXPECT_EQ(json_of(sandbox, "n/session.json")["attempts"], 2);
  EXPECT_EQ(sandbox.run("session n.toml --out n --repeat A").exit_code, 1) << "counted, too";
  EXPECT_EQ(json_of(sandbox, "n/session.json")["attempts"], 2);
}

TEST(SessionCommand, CtrlCIsDarkFirstAndTheFolderIsComplete) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"),
            "[session]\nset = [\"grid.min_cells=2000\", \"plant.model=reduced\"]\n"
            "[[spot]]\nname = \"long\"\nduration_ms = 60000\n"
            "[[spot]]\nname = \"short\"\nduration_ms = 20\n");
  // Once the first spot's log is there it is being treated.
  const ProgramResult result = sandbox.run(
      "session s.toml --out s",
      "sh -c '(i=0; while [ $i -lt 600 ] && ! [ -e s/spots/001-long/log ]; do sleep 0.1; "
      "i=$((i+1)); done; sleep 0.3; kill -INT $$) & exec \"$0\" \"$@\"'");
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const Json session = json_of(sandbox, "s/session.json");
  EXPECT_EQ(session["end"], "interrupted");
  EXPECT_EQ(session["plan"][0]["ending"], "interrupted");
  EXPECT_EQ(session["plan"][1]["ending"], "planned");
  EXPECT_TRUE(std::filesystem::exists(sandbox.path("s/spots/001-long/report.html")));
  const Json summary = json_of(sandbox, "s/spots/001-long/summary.json");
  EXPECT_EQ(summary["stopped_for"], "interrupted by the user");
  // It goes on with the next one.
  EXPECT_EQ(sandbox.run("session s.toml --out s").exit_code, 1) << "the first spot is not treated";
  EXPECT_EQ(json_of(sandbox, "s/session.json")["plan"][1]["ending"], "treated");
}

TEST(SessionCommand, OnAnEyeEachSpotHasAProcessOfItsOwn) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"),
            "[session]\ndevice = \"eye\"\nlearn = true\n"
            "set = [\"grid.min_cells=2000\", \"photoacoustics.eye_pacing=lockstep\"]\n"
            "[[spot]]\nname = \"A\"\nduration_ms = 60\n"
            "[[spot]]\nname = \"B\"\nduration_ms = 60\nset = "
            "[\"plant.absorption_factor=0.6\"]\n");
  const ProgramResult result = sandbox.run("session s.toml --out s");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json session = json_of(sandbox, "s/session.json");
  EXPECT_EQ(session["treated_spots"], 2);
  const double a = session["attempt"][0]["absorption"], b = session["attempt"][1]["absorption"];
  EXPECT_GT(a, b + 0.2) << "each process has its spot's eye: 1.1 and 0.6";
  EXPECT_NE(session["attempt"][1]["prior"], session["attempt"][0]["prior"]) << "what was learnt";
  const Json summary = json_of(sandbox, "s/spots/002-B/summary.json");
  EXPECT_EQ(summary["device"]["lockstep"], true) << summary["device"];
}

TEST(SessionCommand, ADeviceThatFailsEndsTheSessionWithExitCode3) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"), std::string("[session]\ndevice = \"driver:") +
                                        PHOTOCOAG_EXAMPLE_DRIVER +
                                        ",fail=open\"\n"
                                        "set = [\"grid.min_cells=2000\"]\n"
                                        "[[spot]]\nname = \"A\"\n[[spot]]\nname = \"B\"\n");
  const ProgramResult result = sandbox.run("session s.toml --out s");
  EXPECT_EQ(result.exit_code, 3) << result.err;
  const Json session = json_of(sandbox, "s/session.json");
  EXPECT_EQ(session["end"], "device-fault");
  EXPECT_EQ(session["attempts"], 1);
  EXPECT_EQ(count_of(read_all(sandbox.path("s/index.html")), "device fault"), 6U)
      << "twice on both maps, in the legend, in the table";
}

TEST(SessionCommand, TheStudyComparesTheSameEyesWithAndWithoutLearning) {
  const Sandbox sandbox;
  write_all(sandbox.path("s.toml"), small_session("learn = true\n"));
  const ProgramResult result = sandbox.run("session s.toml --study 3");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(count_of(result.out, "\n"), 9U) << result.out;
  EXPECT_EQ(sandbox.run("session s.toml --study 3").out, result.out);
}

}  // namespace
}  // namespace photocoag::testing
