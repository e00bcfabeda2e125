// What export-c writes: compilers have nothing to say about it, sanitizers neither; the same bytes
// again; what it does not carry is refused by name.
#include <gtest/gtest.h>

#include <array>
#include <string_view>

#include "export/exported.hpp"
#include "export/replay.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/process.hpp"
#include "photocoag/export/c_sources.hpp"
#include "support/reduced_models.hpp"
#include "support/thrown.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag::testing {
namespace {

const ReducedModel& model() {
  static const ReducedModel made = coarse_model();
  return made;
}

ControlSettings with_horizon(int horizon) {
  ControlSettings control;
  control.horizon = horizon;
  return control;
}

std::vector<ExportedFile> files_of(int horizon, bool single) {
  return export_c(model(), with_horizon(horizon), {}, {.single_precision = single});
}

std::vector<ExportedFile> chance_files_of(int horizon, bool single, std::size_t which = 0) {
  const ReplayCase one = chance_cases(horizon)[which];
  return export_c(chance_model(one), one.control, one.estimator, {.single_precision = single});
}

bool is_installed(const std::string& program) { return run_program({program, "--version"}).found; }

// What a compiler says; empty: nothing, and the code is 0.
std::string words_of(const std::string& compiler, const std::vector<std::string>& machine,
                     const std::vector<ExportedFile>& files) {
  const ExportedFolder folder(files);
  std::string said;
  for (const std::string& source : folder.sources()) {
    std::vector<std::string> command = {compiler, "-O2", "-c", source, "-o", source + ".o"};
    for (const std::string& flag : strict_flags()) command.push_back(flag);
    command.insert(command.end(), machine.begin(), machine.end());
    const ProgramResult result = run_program(command);
    said += result.errors;
    if (result.exit_code != 0) said += source + " failed";
  }
  return said;
}

struct Compiler {
  std::string name;
  bool single;
  std::vector<std::string> machine = {};
};

class Compilers : public ::testing::TestWithParam<Compiler> {};

TEST_P(Compilers, AcceptEveryHorizon) {
  const Compiler& compiler = GetParam();
  if (!is_installed(compiler.name)) GTEST_SKIP() << compiler.name << " is not installed";
  for (const int horizon : {2, 5, 10, 20}) {
    EXPECT_EQ(words_of(compiler.name, compiler.machine, files_of(horizon, compiler.single)), "")
        << "N = " << horizon;
    EXPECT_EQ(words_of(compiler.name, compiler.machine, chance_files_of(horizon, compiler.single)),
              "")
        << "chance, N = " << horizon;
  }
}

// gcc in single precision: tests/export/replay_test.cpp.
INSTANTIATE_TEST_SUITE_P(All, Compilers,
                         ::testing::Values(Compiler{"gcc", false}, Compiler{"clang", true},
                                           Compiler{"arm-none-eabi-gcc",
                                                    true,
                                                    {"-mcpu=cortex-m4", "-mthumb",
                                                     "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"}}),
                         [](const auto& one) { return one.index == 2 ? "arm" : one.param.name; });

TEST(ExportedFiles, EverythingElseCompilesToo) {
  ControlSettings control = with_horizon(3);
  control.robust = Robustness::kCertified;
  control.state_weight = StateWeight::kDelayed;
  control.power_weight = 10.0;
  control.delay = 1;
  control.solve_every = 2;
  control.first_power = 0.02;
  control.reference_times = {0.0, 0.1};
  control.reference_values = {20.0, 30.0};
  control.shares = {0.9};
  EstimatorSettings estimator;
  estimator.outlier_sigma = 0.0;
  Tissue normalized;
  normalized.volume_temperature = VolumeTemperature::kNormalized;
  const ReducedModel other = coarse_model(normalized);
  EXPECT_EQ(words_of("gcc", {}, export_c(other, control, estimator, {.single_precision = true})),
            "");
  for (const std::size_t which : {1U, 2U, 3U}) {
    EXPECT_EQ(words_of("gcc", {}, chance_files_of(3, true, which)), "") << which;
  }
}

void sanitizers_are_quiet(const std::vector<ExportedFile>& files, const char* periods) {
  const ExportedFolder folder(files);
  const std::string program = folder.path("torture");
  std::vector<std::string> command = {"gcc",
                                      "-std=c99",
                                      "-O1",
                                      "-g",
                                      periods,
                                      "-fsanitize=address,undefined,float-divide-by-zero",
                                      "-fno-sanitize-recover=address,undefined",
                                      "-I",
                                      folder.path(""),
                                      "-o",
                                      program,
                                      PHOTOCOAG_SOURCE_DIR "/tests/export/torture.c"};
  for (const std::string& source : folder.sources()) command.push_back(source);
  command.emplace_back("-lm");
  ASSERT_EQ(run_program(command).errors, "");
  const ProgramResult run = run_program({program});
  EXPECT_EQ(run.exit_code, 0) << run.output << run.errors;
  EXPECT_EQ(run.errors, "");
}

TEST(ExportedFiles, SanitizersAreQuietWhateverComesIn) {
  for (const int horizon : {2, 5, 20}) {
    const char* const periods = horizon < 20 ? "-DPERIODS=4000" : "-DPERIODS=400";
    for (const bool single : {false, true}) {
      if (horizon == 20 && !single) continue;
      sanitizers_are_quiet(files_of(horizon, single), periods);
      sanitizers_are_quiet(chance_files_of(horizon, single, horizon == 5 ? 2 : 1), periods);
    }
  }
}

// Time, power, true and estimated peak of the example's last line.
std::array<double, 4> example_ends(const std::vector<ExportedFile>& files) {
  const ExportedFolder folder(files);
  const std::string build = folder.path("build");
  EXPECT_EQ(run_program({"cmake", "-S", folder.path(""), "-B", build}).exit_code, 0);
  EXPECT_EQ(run_program({"cmake", "--build", build}).exit_code, 0);
  const ProgramResult run = run_program({build + "/pc_example"});
  EXPECT_EQ(run.exit_code, 0);
  std::array<double, 4> last{};
  const std::size_t at = run.output.rfind("\n250 ");
  EXPECT_NE(at, std::string::npos) << run.output;
  if (at == std::string::npos) return last;
  EXPECT_EQ(std::sscanf(run.output.c_str() + at, "%lf %lf %lf %lf", &last[0], &last[1], &last[2],
                        &last[3]),
            4);
  return last;
}

TEST(ExportedFiles, TheExampleHoldsTheLimit) {
  const std::array<double, 4> last = example_ends(files_of(5, true));
  EXPECT_NEAR(last[2], 30.0, 0.1);
  EXPECT_NEAR(last[3], 30.0, 0.1);
}

TEST(ExportedFiles, TheExampleHoldsTheLimitWithAProbability) {
  ControlSettings control;
  control.robust = Robustness::kChance;
  const std::array<double, 4> last =
      example_ends(export_c(model_of_seven(), control, believing(), {.single_precision = true}));
  EXPECT_GT(last[2], 25.0);
  EXPECT_LT(last[2], 30.1);
  EXPECT_NEAR(last[3], last[2], 3.0);
}

void expect_same_bytes(const std::vector<ExportedFile>& first,
                       const std::vector<ExportedFile>& second) {
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].name, second[i].name);
    EXPECT_EQ(first[i].text, second[i].text);
    EXPECT_EQ(first[i].text.find('@'), std::string::npos) << first[i].name;
  }
}

TEST(ExportedFiles, AreTheSameBytesAgain) {
  expect_same_bytes(files_of(5, false), files_of(5, false));
  expect_same_bytes(chance_files_of(5, true), chance_files_of(5, true));
}

TEST(ExportedFiles, NameTheModelAndTellWhatTheyAreNot) {
  const std::string file = to_json(model());
  for (const ExportedFile& one : export_c(model(), {}, {}, {.config_sha256 = "0123abcd"})) {
    if (one.name == "pc_model.h") {
      const std::string key = "PC_MODEL_SHA256 \"";
      const std::string checksum = one.text.substr(one.text.find(key) + key.size(), 64);
      EXPECT_NE(file.find("\"checksum\": \"" + checksum + "\""), std::string::npos);
      EXPECT_NE(one.text.find("0123abcd"), std::string::npos);
    }
    if (one.name != "pc_controller.h" && one.name != "README.md") continue;
    std::string lower = one.text;
    for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    EXPECT_NE(lower.find("the supervisor is not in it"), std::string::npos) << one.name;
    EXPECT_NE(lower.find("not a medical"), std::string::npos) << one.name;
  }
}

TEST(ExportedFiles, EveryNameHasThePrefix) {
  for (const ExportedFile& file : export_c(model(), {}, {}, {.prefix = "left_eye_"})) {
    EXPECT_EQ(file.text.find("pc_"), std::string::npos) << file.name;
    EXPECT_EQ(file.text.find("PC_"), std::string::npos) << file.name;
    EXPECT_TRUE(!file.name.ends_with(".h") || file.name.starts_with("left_eye_")) << file.name;
  }
}

// No heap, no stdio, no state of their own.
TEST(ExportedFiles, TheSourcesAskForLittle) {
  const std::vector<std::string_view> allowed = {"math.h", "stdbool.h", "stdint.h"};
  for (const CSource& source : c_sources()) {
    if (source.name == "example.c" || source.name == "README.md") continue;
    for (std::size_t at = 0; (at = source.text.find("#include <", at)) != std::string::npos;) {
      at += 10;
      const std::string_view name = source.text.substr(at, source.text.find('>', at) - at);
      EXPECT_NE(std::find(allowed.begin(), allowed.end(), name), allowed.end()) << name;
    }
  }
  for (const auto& files : {files_of(5, true), chance_files_of(5, true)}) {
    const ExportedFolder folder(files);
    for (const std::string& source : folder.sources()) {
      const std::string object = source + ".o";
      ASSERT_EQ(run_program({"gcc", "-std=c99", "-O2", "-c", source, "-o", object}).exit_code, 0);
      const std::string symbols = run_program({"nm", object}).output;
      for (const char* kind : {" d ", " D ", " b ", " B ", " C "}) {
        EXPECT_EQ(symbols.find(kind), std::string::npos) << source << "\n" << symbols;
      }
    }
  }
}

ErrorParts refused(const ControlSettings& control, const EstimatorSettings& estimator,
                   const CExportOptions& options = {}) {
  return thrown_by([&] { export_c(model(), control, estimator, options); });
}

TEST(ExportedFiles, WhatTheyDoNotCarryIsRefusedByName) {
  ControlSettings control;
  EstimatorSettings estimator;
  control = {};
  control.solver = SolverKind::kOsqp;
  EXPECT_EQ(refused(control, estimator).key, "control.solver");
  control = {};
  estimator.kind = EstimatorKind::kMhe;
  EXPECT_EQ(refused(control, estimator).key, "estimator.kind");
  estimator = believing();
  control.robust = Robustness::kCertified;
  EXPECT_EQ(refused(control, estimator).key, "control.robust");
  control.robust = Robustness::kChance;
  EXPECT_EQ(refused(control, {}).key, "control.robust");  // nothing is declared uncertain
  estimator.timing.averaging = 0.2;
  EXPECT_EQ(refused(control, estimator).key, "estimator.sample_averaging_periods");
  control = {};
  estimator = {};
  estimator.unknowns = Unknowns::kRpeAndChoroid;
  EXPECT_EQ(refused(control, estimator).key, "estimator.unknowns");
  estimator = {};
  control.period = 2e-3;
  EXPECT_EQ(refused(control, estimator).key, "control.period_ms");
  for (const char* prefix : {"", "1a", "Pc_", "a-b", "a b", "abcdefghijklmnopqrstu"}) {
    EXPECT_EQ(refused({}, {}, {.prefix = prefix}).key, "--prefix") << prefix;
  }
}

}  // namespace
}  // namespace photocoag::testing
