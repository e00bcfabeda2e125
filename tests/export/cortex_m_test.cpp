// What a period takes on a Cortex-M4F and M7: instructions, code, memory. Skipped without
// arm-none-eabi-gcc and qemu-system-arm.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <sstream>

#include "export/replay.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/process.hpp"
#include "support/reduced_models.hpp"

namespace photocoag::testing {
namespace {

// Smaller by a sixth than with -O2, and slower by a twentieth.
const char* const kOptimize = "-Os";

struct Core {
  std::string name;
  std::string fpu;
  std::string board;
};
constexpr int kPeriods = 1500;
const Core kM4{"cortex-m4", "fpv4-sp-d16", "mps2-an386"};
const Core kM7{"cortex-m7", "fpv5-sp-d16", "mps2-an500"};

struct Footprint {
  int mean = 0;        // instructions of a period
  int worst = 0;       // the same
  int code = 0;        // bytes, with constants, without libm
  int state = 0;       // bytes of a controller
  int stack = 0;       // bytes
  double power = 0.0;  // W, mean
};

std::string recorded_header(const std::vector<ReplayCycle>& recorded) {
  std::string text = fmt::format(
      "#define RECORDED {}\nstatic const float recorded[RECORDED][3] = {{\n", recorded.size());
  for (const ReplayCycle& cycle : recorded) {
    text += fmt::format("  {{{}.0F, {}, {:.9e}F}},\n", cycle.first ? 1 : 0,
                        std::isnan(cycle.sample) ? "NAN" : fmt::format("{:.9e}F", cycle.sample),
                        cycle.applied);
  }
  return text + "};\n";
}

bool has_tools() {
  return run_program({"arm-none-eabi-gcc", "--version"}).found &&
         run_program({"qemu-system-arm", "--version"}).found;
}

int number_after(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name + " ");
  return at == std::string::npos ? -1 : std::stoi(text.substr(at + name.size() + 1));
}

// Bytes of text and data of objects, as arm-none-eabi-size counts them.
int size_of(const std::vector<std::string>& objects) {
  std::vector<std::string> command = {"arm-none-eabi-size", "-t"};
  command.insert(command.end(), objects.begin(), objects.end());
  std::istringstream lines(run_program(command).output);
  std::string line;
  int total = 0;
  while (std::getline(lines, line)) {
    if (line.find("TOTALS") != std::string::npos) total = std::stoi(line);
  }
  return total;
}

Footprint footprint(const Core& core, const std::vector<ExportedFile>& files,
                    const std::vector<ReplayCycle>& recorded) {
  const ExportedFolder folder(files);
  write_file(folder.path("recorded.h"), recorded_header(recorded));
  std::vector<std::string> compiler = {"arm-none-eabi-gcc", "-mcpu=" + core.name, "-mthumb",
                                       "-mfloat-abi=hard",  "-mfpu=" + core.fpu,  kOptimize};
  for (const std::string& flag : strict_flags()) compiler.push_back(flag);
  std::vector<std::string> objects;
  for (const std::string& source : folder.sources()) {
    std::vector<std::string> command = compiler;
    objects.push_back(source + ".o");
    command.insert(command.end(), {"-c", source, "-o", objects.back()});
    EXPECT_EQ(run_program(command).errors, "");
  }
  Footprint result;
  result.code = size_of(objects);
  const std::string harness = PHOTOCOAG_SOURCE_DIR "/tests/export/cortex_m/";
  const std::string image = folder.path("count.elf");
  std::vector<std::string> link = {"arm-none-eabi-gcc",
                                   "-mcpu=" + core.name,
                                   "-mthumb",
                                   "-mfloat-abi=hard",
                                   "-mfpu=" + core.fpu,
                                   kOptimize,
                                   "-std=c99",
                                   "-nostartfiles",
                                   "-T",
                                   harness + "memory.ld",
                                   "-I",
                                   folder.path(""),
                                   harness + "startup.c",
                                   harness + "count.c"};
  link.insert(link.end(), objects.begin(), objects.end());
  link.insert(link.end(), {"-lm", "--specs=nosys.specs", "-o", image});
  const ProgramResult linked = run_program(link);
  EXPECT_EQ(linked.exit_code, 0) << linked.errors;
  const ProgramResult run =
      run_program({"qemu-system-arm", "-M", core.board, "-nographic", "-icount", "shift=0",
                   "-semihosting-config", "enable=on,target=native", "-kernel", image});
  const std::string said = run.output + run.errors;
  result.mean = number_after(said, "mean");
  result.worst = number_after(said, "worst");
  result.state = number_after(said, "state");
  result.stack = number_after(said, "stack");
  result.power = 1e-9 * number_after(said, "power_nW");
  EXPECT_GT(result.worst, 0) << said;
  return result;
}

// Noise keeps the estimate at the limit, and the laser is hardly enough.
ReplayCase at_the_limit(int horizon) {
  ReplayCase one;
  one.control.horizon = horizon;
  one.control.peak_max = 30.05;
  one.control.power_max = 0.03;
  return one;
}

void expect_about(int found, int documented, const char* what) {
  EXPECT_NEAR(found, documented, 0.05 * documented) << what;
}

Footprint measured(const Core& core, const ReducedModel& model, const ReplayCase& one,
                   const std::vector<ReplayCycle>& recorded) {
  const Footprint found = footprint(
      core, export_c(model, one.control, one.estimator, {.single_precision = true}), recorded);
  std::cout << fmt::format(
      "{}, N = {}: mean {}, worst {} instructions, code {}, state {}, stack {} B\n", core.name,
      one.control.horizon, found.mean, found.worst, found.code, found.state, found.stack);
  return found;
}

struct Expectation {
  const Core& core;
  int horizon;
  int mean;
  int worst;
  int code;
};

// The figures of docs/embedding-c.md.
class CortexM : public ::testing::TestWithParam<Expectation> {};

TEST_P(CortexM, TakesWhatTheDocumentSays) {
  if (!has_tools()) {
    // Set by continuous integration where both are installed.
    ASSERT_EQ(std::getenv("PHOTOCOAG_CORTEX_M"), nullptr) << "compiler or emulator is not found";
    GTEST_SKIP() << "arm-none-eabi-gcc or qemu-system-arm is not installed";
  }
  static const ReducedModel model = coarse_model();
  const Expectation& expected = GetParam();
  const ReplayCase one = at_the_limit(expected.horizon);
  const std::vector<ReplayCycle> recorded = record(model, one, kPeriods, 3);
  int limited = 0;
  double power = 0.0;
  for (const ReplayCycle& cycle : recorded) {
    limited += cycle.limited ? 1 : 0;
    power += cycle.power / kPeriods;
  }
  EXPECT_GT(limited, kPeriods / 10);
  const Footprint found = measured(expected.core, model, one, recorded);
  EXPECT_NEAR(found.power, power, 1e-7);  // it is the same controller
  expect_about(found.mean, expected.mean, "mean");
  expect_about(found.worst, expected.worst, "worst");
  expect_about(found.code, expected.code, "code");
  if (expected.horizon == 5) {
    EXPECT_LE(found.worst, 15000);
    EXPECT_LE(found.code, 8192);
  }
}

const auto kName = [](const auto& one) {
  return fmt::format("{}_N{}", one.param.core.name == "cortex-m4" ? "M4" : "M7", one.param.horizon);
};

// Seven quantities and the noise; treatments of 250 periods.
class CortexMChance : public ::testing::TestWithParam<Expectation> {};

TEST_P(CortexMChance, TakesWhatTheDocumentSays) {
  if (!has_tools()) GTEST_SKIP() << "arm-none-eabi-gcc or qemu-system-arm is not installed";
  const Expectation& expected = GetParam();
  const ReplayCase one = chance_cases(expected.horizon)[0];
  const ReducedModel model = chance_model(one);
  const std::vector<ReplayCycle> recorded = record(model, one, kPeriods, 3);
  double power = 0.0;
  for (const ReplayCycle& cycle : recorded) power += cycle.power / kPeriods;
  const Footprint found = measured(expected.core, model, one, recorded);
  EXPECT_NEAR(found.power, power, 1e-6);  // it is the same controller
  expect_about(found.mean, expected.mean, "mean");
  expect_about(found.worst, expected.worst, "worst");
  expect_about(found.code, expected.code, "code");
}

INSTANTIATE_TEST_SUITE_P(Documented, CortexMChance,
                         ::testing::Values(Expectation{kM4, 2, 39943, 219960, 15352},
                                           Expectation{kM4, 5, 62058, 245120, 17208},
                                           Expectation{kM4, 10, 129662, 317120, 17508},
                                           Expectation{kM4, 20, 463423, 870360, 18092},
                                           Expectation{kM7, 5, 61946, 244880, 17092}),
                         kName);

INSTANTIATE_TEST_SUITE_P(Documented, CortexM,
                         ::testing::Values(Expectation{kM4, 2, 5003, 5320, 6368},
                                           Expectation{kM4, 5, 10060, 12520, 8092},
                                           Expectation{kM4, 10, 26250, 39920, 8308},
                                           Expectation{kM4, 20, 100246, 186800, 8724},
                                           Expectation{kM7, 5, 10024, 12480, 7996}),
                         kName);

}  // namespace
}  // namespace photocoag::testing
