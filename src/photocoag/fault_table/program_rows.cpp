// Rows of the fault table that run the program itself: T5 (signals), T6 (wall clock), T7 (no
// privileges), F1 to F3 (bad model files, wrong model, bad calibration), X3 (no memory).
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <sstream>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/fault_table/bad_models.hpp"
#include "photocoag/fault_table/process_bench.hpp"
#include "photocoag/fault_table/program_run.hpp"
#include "photocoag/log/reader.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

/// A run with the library of tools/shim preloaded, and that library's output; empty if it was not
/// loaded.
struct ShimRun {
  ProgramRun program;
  std::string report;
};

ShimRun run_with_shim(const ProcessFaultOptions& options, const fs::path& folder,
                      const Arguments& arguments, const std::string& setting) {
  // LD_PRELOAD is split at blanks and colons: a name in the folder where the program starts.
  fs::create_symlink(fs::absolute(options.shim), folder / "shim.so");
  const std::string report = (folder / "shim.txt").string();
  const int file = ::open(report.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0644);
  ShimRun run;
  run.program = run_program(options, folder, arguments,
                            {.environment = {"LD_PRELOAD=./shim.so", setting,
                                             fmt::format("PHOTOCOAG_SHIM_REPORT={}", file)},
                             .during = {}});
  ::close(file);
  run.report = read_file(report, std::size_t{1} << 26);
  return run;
}

/// A treatment of a coarse eye: what is tested is the program, not the physics.
Arguments treatment(double absorption, const char* command, int milliseconds) {
  return {command,
          "--out",
          "out",
          "--set",
          "grid.min_cells=2000",
          "--set",
          fmt::format("plant.absorption_factor={}", absorption),
          "--set",
          fmt::format("run.duration_ms={}", milliseconds)};
}

Arguments with(Arguments arguments, const std::string& setting) {
  arguments.insert(arguments.end(), {"--set", setting});
  return arguments;
}

/// Refused: exit code 2, nothing written, the message names `name`.
std::string refused(const ProgramRun& run, const fs::path& folder, const std::string& name) {
  if (run.code != 2) return fmt::format("exit code {}: {}", run.code, last_line(run.said));
  if (fs::exists(folder / "out")) return "a run folder was made: the device was opened";
  if (run.said.find(name) == std::string::npos) return "the message does not name " + name;
  return {};
}

std::string signalled(const ProcessFaultOptions& options, double absorption, int signal) {
  const ScratchFolder folder;
  const fs::path segment = folder.path() / "out" / "log" / "000000.seg";
  const ProgramRun run =
      run_program(options, folder.path(), treatment(absorption, "treat", 20000),
                  {.environment = {}, .during = [&](pid_t child) {
                     const std::int64_t patience = monotonic_ns() + 60'000'000'000;
                     std::error_code error;
                     // Records in the log: it is treating.
                     while (monotonic_ns() < patience && (!fs::exists(segment, error) ||
                                                          fs::file_size(segment, error) < 40'000)) {
                       wait_until(monotonic_ns() + 5'000'000);
                     }
                     kill(child, signal);
                   }});
  if (run.code != 1) return fmt::format("exit code {}: {}", run.code, last_line(run.said));
  const LogContent log = read_segments(segments_of(folder.path() / "out"));
  if (!log.closed) return "the log was not closed";
  if (!fs::exists(folder.path() / "out" / "summary.json")) return "no summary";
  if (log.records.size() < 2 || log.records.back().power != 0.0) return "light at the end";
  // The request is seen at the end of a cycle: 0 W is what it writes then.
  const LogRecord& asked = log.records[log.records.size() - 2];
  if (!asked.end.sample.stop_asked && asked.safety == SafetyState::kTreating)
    return "it went on after the request";
  return asked.end.next_power == 0.0 ? "" : "not off at once";
}

std::string jumping_clock(const ProcessFaultOptions& options, double absorption) {
  std::string expected;
  {
    const ScratchFolder folder;
    run_program(options, folder.path(), treatment(absorption, "simulate", 100));
    expected = read_file((folder.path() / "out" / "run.csv").string(), std::size_t{1} << 26);
  }
  // Without --out the run folder is named after the wall clock: a reading at least.
  Arguments unnamed = treatment(absorption, "treat", 100);
  unnamed.erase(unnamed.begin() + 1, unnamed.begin() + 3);
  // On a busy machine some attempts overrun, which changes the powers.
  std::string overruns = "every attempt overran";
  for (int attempt = 0; attempt < 10; ++attempt) {
    const ScratchFolder folder;
    const auto [run, shim] =
        run_with_shim(options, folder.path(), unnamed, "PHOTOCOAG_SHIM_CLOCK=1");
    if (shim.find("jumped") == std::string::npos) return "the wall clock has not jumped: " + shim;
    if (run.code != 0) return fmt::format("exit code {}: {}", run.code, last_line(run.said));
    if (run.said.find(" 0 overruns") == std::string::npos) continue;
    const fs::path out = fs::directory_iterator(folder.path() / "runs")->path();
    const std::string got = read_file((out / "run.csv").string(), std::size_t{1} << 26);
    return got == expected ? "" : "the powers differ";
  }
  return overruns;
}

std::string without_privileges(const ProcessFaultOptions& options, double absorption) {
  const ScratchFolder folder;
  const RunSetup setup{.environment = {}, .unprivileged = true, .during = {}};
  const Arguments plain = treatment(absorption, "treat", 20);
  const ProgramRun enforced =
      run_program(options, folder.path(), with(plain, "safety.real_time=enforce"), setup);
  const std::string why = refused(enforced, folder.path(), "safety.real_time");
  if (!why.empty()) return "enforce: " + why;
  // A busy machine may overrun and stop, but it must treat and state its scheduling.
  const ProgramRun observed = run_program(options, folder.path(), plain, setup);
  if (observed.code > 1) return fmt::format("observe: exit code {}", observed.code);
  if (observed.said.find("ordinary scheduling, memory not locked") == std::string::npos) {
    return "observe: " + last_line(observed.said);
  }
  return observed.said.find("observe ") == std::string::npos ? "observe: no banner" : "";
}

void bad_model_files(const ProcessFaultOptions& options, double absorption, FaultRow& row) {
  const ProcessBench bench(options, absorption);
  const ScratchFolder folder;
  for (const BadModel& bad : bad_models(bench.model)) {
    write_file((folder.path() / "bad.json").string(), bad.text);
    const ProgramRun run = run_program(
        options, folder.path(), with(treatment(absorption, "treat", 20), "model.file=bad.json"));
    const std::string why = refused(run, folder.path(), "bad.json");
    count(row, why.empty() ? "" : bad.what + ": " + why);
    fs::remove_all(folder.path() / "out");
  }
}

/// Good files of another run: each differs from the configuration in one thing.
void wrong_models(const ProcessFaultOptions& options, double absorption, FaultRow& row) {
  const ScratchFolder folder;
  const auto make = [&](const Config& config) {
    ModelStore models(config, true);
    save_reduced_model(models.reduced(), (folder.path() / "model.json").string());
  };
  const auto run = [&](const std::string& setting) {
    return run_program(
        options, folder.path(),
        with(with(treatment(absorption, "treat", 20), "model.file=model.json"), setting));
  };
  make(load_config("", {"grid.min_cells=2000"}));
  const ProgramRun fitting = run("run.seed=1");
  count(row, fitting.code <= 1 ? "" : "the fitting model: " + last_line(fitting.said));
  fs::remove_all(folder.path() / "out");
  for (const auto& [setting, name] :
       {std::pair{"control.period_ms=2", "control.period_ms"},
        std::pair{"model.discretization=implicit-euler", "discretization"},
        std::pair{"tissue.spot_radius_um=90", "tissue"},
        std::pair{"tissue.layers.RPE.thickness_um=5", "RPE"},
        std::pair{"estimator.absorption_initial=0.25", "absorption_initial"}}) {
    const std::string why = refused(run(setting), folder.path(), name);
    count(row, why.empty() ? "" : fmt::format("{}: {}", setting, why));
  }
}

/// The calibration is checked on the cold eye: zero, noise, and that there is a curve.
void bad_calibration(const ProcessFaultOptions& options, double absorption, FaultRow& row) {
  const ProcessBench bench(options, absorption);
  const auto baseline = [&](double gain, double offset) {
    SimulatedEye<FullOrderPlant> eye = bench.fresh_eye(3);
    std::vector<double> samples;
    for (std::uint64_t k = 0; k < 64; ++k) {
      samples.push_back(gain * eye.advance(k).sample.volume_temperature + offset);
    }
    return samples;
  };
  struct Case {
    const char* what;
    std::vector<double> samples;
    bool good;
  };
  const std::vector<Case> cases = {
      {"healthy", baseline(1.0, 0.0), true},
      {"gain x1e3", baseline(1e3, 0.0), false},
      {"gain x1e-3", baseline(1e-3, 0.0), false},
      {"zero off by 1 K", baseline(1.0, 1.0), false},
      {"no samples", {}, false},
      {"NaN", std::vector<double>(64, std::numeric_limits<double>::quiet_NaN()), false}};
  for (const Case& test : cases) {
    SelfTestReport report = self_test_of(test.samples);
    report.interlock_closed = report.shutter_open = report.foot_switch = true;
    report.watchdog_tripped = report.model_matches = report.solver_exact = report.log_has_room =
        true;
    bool ready = true;  // not checked without the supervisor
    if (options.supervised) {
      Supervisor supervisor(safety_limits(bench.config), bench.observer);
      supervisor.power_on();
      ready = supervisor.finish_self_test(report) && supervisor.ready();
    }
    count(row,
          ready == test.good ? "" : fmt::format("{}: {}", test.what, ready ? "READY" : "refused"),
          !ready);
  }
  // Curve files, before any device: 1e3 is degrees written as thousandths.
  struct Curve {
    const char* what;
    const char* text;
    const char* named;
  };
  const Curve curves[] = {
      {"missing", nullptr, "curve.toml"},
      {"falling", "coefficients = [1.0, -0.004]\nvalid_C = [1, 100]", "curve"},
      {"temperatures times 1e3", "coefficients = [0.0053, 4.3e-6]\nvalid_C = [1, 1e5]", "curve"},
      {"temperatures over 1e3", "coefficients = [0.0053, 4.3]\nvalid_C = [0.001, 0.1]", "valid_C"},
      {"too short", "coefficients = [0.0053, 0.0043]\nvalid_C = [30, 100]", "valid_C"},
      {"not a number", "coefficients = [nan, 0.0043]\nvalid_C = [1, 100]", "curve"}};
  for (const Curve& curve : curves) {
    const ScratchFolder folder;
    if (curve.text != nullptr) {
      write_file((folder.path() / "curve.toml").string(),
                 std::string("[curve]\nsource = \"test\"\n") + curve.text + "\n");
    }
    Arguments arguments =
        with(treatment(absorption, "treat", 20), "photoacoustics.calibration=curve.toml");
    arguments.insert(arguments.end(), {"--device", "eye"});
    const std::string trouble =
        refused(run_program(options, folder.path(), arguments, {}), folder.path(), curve.named);
    count(row, trouble.empty() ? "" : fmt::format("{} curve: {}", curve.what, trouble),
          trouble.empty());
  }
}

void no_memory(const ProcessFaultOptions& options, double absorption, FaultRow& row) {
  const ScratchFolder folder;
  // The model is cached, as at any but the first start.
  ModelStore(load_config("", {"grid.min_cells=2000"}), true).reduced();
  Arguments arguments = treatment(absorption, "treat", 20);
  arguments[2] = "out@";
  const auto [run, shim] =
      run_with_shim(options, folder.path(), arguments,
                    fmt::format("PHOTOCOAG_SHIM_MALLOC={}", options.allocation_step));
  std::istringstream lines(shim);
  std::string word;
  if (!(lines >> word) || word != "loaded") return count(row, "the shim was not loaded", false);
  long value = 0;
  long allocations = 0;
  while (lines >> word >> value) {
    if (word == "count") {
      allocations = value;
      continue;
    }
    // A treatment's first write comes after all this: run.csv would be there.
    const bool wrote = fs::exists(folder.path() / ("out" + word) / "run.csv");
    std::string why;
    if (value >= 256 && value < 300) why = fmt::format("signal {}", value - 256);
    if (value != 2 && value != 300 && why.empty()) why = fmt::format("exit code {}", value);
    if (wrote) why = "it has treated";
    count(row, why.empty() ? "" : fmt::format("allocation {}: {}", word, why), value == 2);
  }
  if (run.code != 0 || allocations < 100) {
    count(row, fmt::format("{} allocations counted, exit code {}", allocations, run.code));
  }
}

}  // namespace

void run_program_row(const ProcessFaultOptions& options, FaultRow& row) {
  for (const double absorption : options.absorptions) {
    if (row.id == "T5") {
      for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        const std::string why = signalled(options, absorption, signal);
        count(row, why.empty() ? "" : fmt::format("signal {}: {}", signal, why));
      }
    }
    if (row.id == "T6") count(row, jumping_clock(options, absorption));
    if (row.id == "T7") count(row, without_privileges(options, absorption));
    if (row.id == "F1") bad_model_files(options, absorption, row);
    if (row.id == "F2") wrong_models(options, absorption, row);
    if (row.id == "F3") bad_calibration(options, absorption, row);
    if (row.id == "X3") no_memory(options, absorption, row);
  }
}

}  // namespace photocoag
