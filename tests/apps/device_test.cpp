// `treat --device`, `eye` and `calibrate` as a user runs them: processes, sockets, exit codes.
// Times are generous; where the machine itself may be too slow to treat, the test says so and
// accepts it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "apps/program.hpp"

namespace photocoag::testing {
namespace {

using Json = nlohmann::json;

// Coarse grid and few baseline pulses: these tests are about the program, not the physics.
const std::string kCoarse =
    " --set grid.min_cells=2000 --set photoacoustics.baseline_pulses=400 --set "
    "run.duration_ms=120";

Json summary_of(const Sandbox& sandbox, const std::string& run) {
  return Json::parse(read_all(sandbox.path(run) / "summary.json"));
}

/// The machine was too busy for a treatment in wall time: no statement about the program.
bool too_busy(const ProgramResult& result) {
  return result.err.find("supervisor: overrun") != std::string::npos ||
         result.err.find("self-test") != std::string::npos;
}

TEST(TreatDevice, AnEyeOfItsOwnProcess) {
  for (const std::string device : {"eye", "eye+socket"}) {
    const Sandbox sandbox;
    const ProgramResult result = sandbox.run("treat --device " + device + kCoarse + " --out run");
    if (too_busy(result)) GTEST_SKIP() << result.err;
    ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 3) << result.err;
    const Json summary = summary_of(sandbox, "run");
    EXPECT_EQ(summary["device"]["pulses_per_period"], 10);
    EXPECT_NE(result.err.find("answered late"), std::string::npos) << "the eye's own report";
    if (result.exit_code == 0 && summary["overruns"] == 0) {
      EXPECT_LT(summary["peak_true_max_K"], 32.5);
      EXPECT_GT(summary["peak_true_max_K"], 25.0);
      EXPECT_GT(summary["device"]["pulse_peak_true_max_K"], summary["peak_true_max_K"]);
      EXPECT_EQ(sandbox.run("replay run").exit_code, 0) << "the same powers to the last bit";
    }
    // Had the program been killed before it wrote them, the log would give the same rows.
    const std::string rows = read_all(sandbox.path("run") / "run.csv");
    for (const char* file : {"run.csv", "summary.json", "report.html"}) {
      std::filesystem::remove(sandbox.path("run") / file);
    }
    ASSERT_EQ(sandbox.run("convert run --recover").exit_code, 0);
    const auto without_truth = [](const std::string& text) {
      // The eye tells its true temperatures after the treatment, the log does not have them.
      std::istringstream lines(text);
      std::string kept;
      for (std::string line; std::getline(lines, line); kept += '\n') {
        std::istringstream cells(line);
        std::string cell;
        for (int column = 0; std::getline(cells, cell, ','); ++column) {
          if (column != 3 && column != 6) kept += cell + ',';
        }
      }
      return kept;
    };
    EXPECT_EQ(without_truth(read_all(sandbox.path("run") / "run.csv")), without_truth(rows));
    EXPECT_EQ(summary_of(sandbox, "run")["device"]["pulses_per_period"], 10);
    // What the configuration had to say for it is in the run folder.
    EXPECT_NE(read_all(sandbox.path("run") / "config.toml").find("\"pulses\""), std::string::npos);
    EXPECT_EQ(sandbox.run("simulate --config run/config.toml --out again").exit_code, 2);
  }
}

/// On one core of those that we may use.
const std::string kOneCore = "taskset -c $(taskset -cp $$ | sed 's/.*: //;s/[,-].*//')";

TEST(TreatDevice, OnOneCoreTheEyeGoesInLockstep) {
  for (const std::string device : {"eye", "eye+socket"}) {
    const Sandbox sandbox;
    const ProgramResult result =
        sandbox.run("treat --device " + device + kCoarse + " --out run", kOneCore);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("pacing    in lockstep: "), std::string::npos) << result.err;
    const Json summary = summary_of(sandbox, "run");
    EXPECT_EQ(summary["cycles"], 120);
    EXPECT_EQ(summary["overruns"], 0);
    EXPECT_EQ(summary["device"]["lockstep"], true);
    EXPECT_EQ(summary["device"]["late_commands"], 0);
    EXPECT_TRUE(summary["timing"].is_null()) << "not measured";
    EXPECT_FALSE(summary.contains("histograms"));
    EXPECT_LT(summary["peak_true_max_K"], 32.0);
    EXPECT_GT(summary["peak_true_max_K"], 25.0);
    EXPECT_NE(read_all(sandbox.path("run") / "report.html").find("in lockstep"), std::string::npos);
    EXPECT_EQ(sandbox.run("replay run").exit_code, 0) << "the same powers to the last bit";
    for (const char* file : {"run.csv", "summary.json", "report.html"}) {
      std::filesystem::remove(sandbox.path("run") / file);
    }
    ASSERT_EQ(sandbox.run("convert run --recover").exit_code, 0);
    EXPECT_FALSE(summary_of(sandbox, "run").contains("timing")) << "nor is it made up";
  }
}

TEST(TreatDevice, LockstepIsNoRealTimeToEnforce) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run(
      "treat --device eye --set safety.real_time=enforce "
      "--set photoacoustics.eye_pacing=lockstep --out run" +
      kCoarse);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("photoacoustics.eye_pacing"), std::string::npos) << result.err;
}

TEST(TreatDevice, AnyTemporaryFolderWillDoAndNothingStaysInIt) {
  const std::string lockstep = " --set photoacoustics.eye_pacing=lockstep" + kCoarse;
  for (const std::string& folder : {std::string("/no/such/folder"), std::string(120, 'x')}) {
    const Sandbox sandbox;
    std::filesystem::create_directory(sandbox.path(std::string(120, 'x')));
    const std::string where = folder[0] == '/' ? folder : "$PWD/" + folder;
    const ProgramResult result =
        sandbox.run("treat --device eye --out run" + lockstep, "TMPDIR=" + where);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  const Sandbox sandbox;
  const auto folder = sandbox.path("t");
  std::filesystem::create_directory(folder);
  const ProgramResult killed =
      sandbox.run("treat --device eye --out run" + lockstep + " --set run.duration_ms=60000",
                  "TMPDIR=$PWD/t timeout -s KILL 2");
  EXPECT_EQ(killed.exit_code, 137);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST(TreatDevice, ADriversPathMayHoldCommas) {
  const Sandbox sandbox;
  const auto folder = sandbox.path("a,b");
  std::filesystem::create_directory(folder);
  std::filesystem::copy(PHOTOCOAG_EXAMPLE_DRIVER, folder / "driver,v2.so");
  const ProgramResult result =
      sandbox.run("treat --device 'driver:a,b/driver,v2.so,fail=open' --out run" + kCoarse);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("asked to fail by its settings"), std::string::npos) << result.err;
}

TEST(EyeCommand, NoFileIsReplacedAndNoEyesPlaceIsTaken) {
  const Sandbox sandbox;
  write_all(sandbox.path("precious"), "data");
  const ProgramResult result = sandbox.run("eye --socket precious --set grid.min_cells=2000");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("no socket"), std::string::npos) << result.err;
  EXPECT_EQ(read_all(sandbox.path("precious")), "data");
}

TEST(TreatDevice, FaultsOfTheDeviceEndWithExitCode3) {
  for (const std::string fault : {"M2@40+20", "M6@40+20", "A4@40", "A5@40*1"}) {
    const Sandbox sandbox;
    const ProgramResult result =
        sandbox.run("treat --device eye --fault " + fault + kCoarse + " --out run");
    if (too_busy(result)) continue;
    const Json summary = summary_of(sandbox, "run");
    // Where periods were missed the supervisor may have had another reason before.
    if (result.exit_code != 3 && summary["overruns"] > 0) continue;
    EXPECT_EQ(result.exit_code, 3) << fault << result.err;
    EXPECT_EQ(summary["safety"]["state"], "safe_stop") << fault;
    EXPECT_TRUE(std::regex_search(
        result.err, std::regex("STOPPED   supervisor: .*\n {10}[A-Z].*\\.\n {10}device: ")))
        << "in words, and what the device counted: " << result.err;
    std::istringstream lines(read_all(sandbox.path("run") / "run.csv"));
    std::string line;
    std::string last;
    std::getline(lines, line);
    EXPECT_TRUE(line.ends_with(",power_command_W,device_command_W"));
    while (std::getline(lines, line)) last = line.substr(0, line.rfind(','));
    EXPECT_TRUE(last.ends_with(",0")) << "commanded in the end: " << last;
  }
}

TEST(TreatDevice, WhatIsNotThereIsExitCode3AndWhatIsNotKnownIs2) {
  const Sandbox sandbox;
  EXPECT_EQ(sandbox.run("treat --device eye:/no/such/eye --out a" + kCoarse).exit_code, 3);
  EXPECT_EQ(sandbox.run("treat --device driver:/no/such.so --out b" + kCoarse).exit_code, 3);
  for (const std::string bad : {"ear", "eye:", "driver", "driver:", "udp", "udp:"}) {
    const ProgramResult result = sandbox.run("treat --device " + bad + " --out c" + kCoarse);
    EXPECT_EQ(result.exit_code, 2) << bad;
    EXPECT_NE(result.err.find("--device"), std::string::npos) << result.err;
  }
  EXPECT_EQ(sandbox.run("treat --fault M2@3 --out c" + kCoarse).exit_code, 2);
  EXPECT_EQ(sandbox.run("treat --device eye --fault M99@3 --out d" + kCoarse).exit_code, 3);
  const ProgramResult odd = sandbox.run("treat --device eye --out e" + kCoarse +
                                        " --set photoacoustics.pulse_period_ms=0.3");
  EXPECT_EQ(odd.exit_code, 2);
  EXPECT_NE(odd.err.find("photoacoustics.pulse_period_ms"), std::string::npos);
}

TEST(TreatDevice, ADriverIsDrivenAndARealOneNeedsEnforce) {
  const Sandbox sandbox;
  const std::string driver = "treat --device driver:" PHOTOCOAG_EXAMPLE_DRIVER;
  // Its lump of tissue is none of the model's: whether the supervisor lets it run to the end is its
  // business, the folder is complete in any case. The self-test passes with the defaults.
  const ProgramResult lump = sandbox.run(driver + " --out lump" + kCoarse);
  for (const char* item : {"noise:", "mean:", "power:", "model:", "solver:"}) {
    EXPECT_EQ(lump.err.find(item), std::string::npos) << lump.err;
  }
  if (lump.err.find("self-test") != std::string::npos) GTEST_SKIP() << "too busy: " << lump.err;
  EXPECT_NE(lump.exit_code, 2) << lump.err;
  const Json summary = summary_of(sandbox, "lump");
  EXPECT_TRUE(summary["peak_true_max_K"].is_null()) << "a device does not tell";
  EXPECT_EQ(summary["device"]["name"], "driver, example: one time constant");
  EXPECT_TRUE(summary["limit_violations"].is_null());
  EXPECT_TRUE(summary["absorption_error_final"].is_null());
  EXPECT_FALSE(read_all(sandbox.path("lump") / "report.html").empty());
  const std::string table = sandbox.run("convert lump --csv -").out;
  for (const char* file : {"run.csv", "summary.json", "report.html"}) {
    std::filesystem::remove(sandbox.path("lump") / file);
  }
  ASSERT_EQ(sandbox.run("convert lump --recover").exit_code, 0);
  EXPECT_TRUE(summary_of(sandbox, "lump")["peak_true_max_K"].is_null());
  const std::string recovered = read_all(sandbox.path("lump/run.csv"));
  for (const std::string& text : {table, recovered}) {
    const std::size_t row = text.find('\n') + 1;
    EXPECT_NE(text.substr(row, text.find('\n', row) - row).find(",,"), std::string::npos) << text;
  }
  const ProgramResult real =
      sandbox.run("treat --device driver:" PHOTOCOAG_REAL_DRIVER " --out real" + kCoarse);
  EXPECT_EQ(real.exit_code, 2) << real.err;
  EXPECT_NE(real.err.find("safety.real_time"), std::string::npos) << real.err;
}

TEST(TreatDevice, KilledControllersLeaveTheEyeDark) {
  const Sandbox sandbox;
  const ProgramResult result = sandbox.run("faults --kills 3 --stops 2");
  // "late" would be the eye's own lateness as well: it counts in wall time.
  EXPECT_NE(result.out.find("3 controllers killed, 2 stopped"), std::string::npos) << result.err;
  EXPECT_NE(result.out.find("dark within two periods (2 ms): 5 of 5"), std::string::npos)
      << result.out;
}

TEST(Calibrate, FromItsOwnExampleToATreatmentsCurve) {
  const Sandbox sandbox;
  const ProgramResult made = sandbox.run("calibrate --example heating.csv --rows 800");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const ProgramResult fitted = sandbox.run("calibrate heating.csv --out curve.toml");
  EXPECT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_NE(fitted.out.find("800 pulses from 17 to 72 deg C"), std::string::npos) << fitted.out;
  EXPECT_NE(fitted.out.find("degree 1"), std::string::npos);
  const ProgramResult used = sandbox.run(
      "treat --device eye --out run --set "
      "photoacoustics.calibration=curve.toml" +
      kCoarse);
  EXPECT_TRUE(too_busy(used) || used.exit_code == 0 || used.exit_code == 3) << used.err;
  EXPECT_EQ(sandbox.run("calibrate").exit_code, 2);
  EXPECT_EQ(sandbox.run("calibrate no-such.csv").exit_code, 2);
  write_all(sandbox.path("bad.csv"), "temperature_C,amplitude,energy_uJ\n20,1,2\n");
  const ProgramResult bad = sandbox.run("calibrate bad.csv");
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.err.find("8 rows"), std::string::npos) << bad.err;
}

}  // namespace
}  // namespace photocoag::testing
