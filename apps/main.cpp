// The program `photocoag`: command line only. Commands are in commands.hpp.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "commands.hpp"
#include "console.hpp"
#include "device_commands.hpp"
#include "driver_check_command.hpp"
#include "export_fmu_command.hpp"
#include "full_program.hpp"
#include "json_object.hpp"
#include "machine_commands.hpp"
#include "model_commands.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rom/file.hpp"
#include "stack.hpp"
#include "study_commands.hpp"

namespace {

using namespace photocoag;

constexpr int kExitNotPrinted = 1;
constexpr int kExitBadInput = 2;

void add_run(CLI::App& command, RunOptions& options) {
  add_common(command, options);
  add_cache(command, options);
  command
      .add_option("--out", options.out, "run folder, new or empty; default: a new one below runs/")
      ->type_name("DIR");
  command
      .add_option("--seed", options.seed, "seed of the measurement noise, same as --set run.seed=N")
      ->check(given())
      ->type_name("N");
  add_json(command, options.json);
}

struct CommandGroup {
  const char* what_for;
  std::vector<std::string_view> commands;
};

// By what people do; --help shows them so. A command that is not here stands by itself.
void group_commands(CLI::App& app) {
  const CommandGroup groups[] = {
      {"Treat", {"treat", "simulate", "console", "session", "config"}},
      {"Model",
       {"response", "reduce", "field", "export", "export-c", "export-fmu", "certify", "boundaries",
        "discretizations", "information"}},
      {"Study", {"reproduce", "explain", "sweep", "compare", "campaign", "spots", "estimation"}},
      {"Device", {"eye", "calibrate", "driver-check", "convert", "replay", "faults"}},
      {"Machine", {"doctor", "latency", "bench", "completion"}}};
  for (const CommandGroup& group : groups) {
    for (const std::string_view name : group.commands) {
      app.get_subcommand(std::string(name))->group(group.what_for);
    }
  }
}

// The parser looks at --version before it has seen what else there is.
std::string version_text(int argc, char** argv) {
  char** const end = argv + argc;
  if (std::find(argv + 1, end, std::string_view("--json")) == end) {
    return fmt::format("photocoag {} (source {})\n{}", version(), source_hash(), kResearchNotice);
  }
  const nlohmann::ordered_json object = {
      {"name", "photocoag"},
      {"version", version()},
      {"source_hash", source_hash()},
      {"osqp", PHOTOCOAG_HAS_OSQP != 0},
      {"model_file_versions", {kModelFileVersion, kUncertainModelFileVersion}},
      {"notice", kResearchNotice}};
  return object.dump(2);
}

/// Where an exception cannot be caught, as in a library's destructor that finds no memory. Programs
/// that hold a device replace it (rt/last_resort.hpp).
[[noreturn]] void refuse_to_go_on() noexcept {
  constexpr std::string_view kSaid = "photocoag: out of memory: the program ends\n";
  if (write(STDERR_FILENO, kSaid.data(), kSaid.size()) < 0) _exit(kExitBadInput);
  _exit(kExitBadInput);
}

int run_command(int argc, char** argv) {
  if (argc == 2 && argv[1] == std::string_view("--version")) {
    print("{}\n", version_text(argc, argv));
    return 0;
  }
  CLI::App app{
      "photocoag: real-time model predictive control of retinal laser treatment.\n"
      "Heats a spot of a simulated eye to a wanted peak temperature that cannot be measured, with "
      "a laser "
      "power computed every millisecond from a noisy volume temperature."};
  app.name("photocoag");
  bool as_json = false;
  CLI::Option* version_flag =
      app.set_version_flag("--version", [&] { return version_text(argc, argv); });
  app.add_flag("--json", as_json, "with --version: as one JSON object")->needs(version_flag);
  app.require_subcommand(1);
  app.footer(footer(
      "  photocoag treat                                  one treatment, paced by the clock\n"
      "  photocoag simulate --set plant.absorption_factor=0.5\n"
      "  photocoag config                                 every key, its unit, range and default\n"
      "  photocoag COMMAND --help                         what a command does, with examples"));
  int exit_code = 0;

  RunOptions treat_options;
  CLI::App* treat_app = app.add_subcommand(
      "treat",
      "treat a simulated eye in real time (the main job); writes a run folder with a report");
  add_run(*treat_app, treat_options);
  treat_app
      ->add_option("--device", treat_options.device,
                   "eye: a simulated eye in a process of its own, started for this treatment; "
                   "eye:SOCKET: one that runs already; eye+socket: pulses through the socket; "
                   "driver:LIBRARY[,SETTINGS]: a vendor's driver")
      ->type_name("DEVICE");
  treat_app
      ->add_option("--fault", treat_options.faults,
                   "with --device eye: ID@cycle[+count][*value] of docs/devices.md, or a file")
      ->type_name("FAULT")
      ->allow_extra_args(false);
  treat_app->footer(
      footer("  photocoag treat\n"
             "  photocoag treat --device eye\n"
             "  photocoag treat --device eye --fault M2@120\n"
             "  photocoag treat --config configs/paper-250hz-a.toml --seed 7 --out runs/first\n"
             "Ctrl-C puts the laser to 0 W and still writes the run folder."));
  treat_app->callback([&] { exit_code = treat(treat_options); });

  RunOptions simulate_options;
  CLI::App* simulate_app = app.add_subcommand(
      "simulate",
      "the same treatment in virtual time, as fast as it can; same bytes for the same seed");
  add_run(*simulate_app, simulate_options);
  simulate_app->footer(footer(
      "  photocoag simulate --config configs/paper-1khz.toml --set plant.absorption_factor=0.5\n"
      "  photocoag simulate --set plant.tissue.spot_radius_um=90 --out runs/smaller-spot\n"
      "  photocoag simulate --config runs/first/config.toml      (repeats a run)"));
  simulate_app->callback([&] { exit_code = simulate(simulate_options); });

  add_model_commands(app, exit_code);

  ConfigOptions config_options;
  CLI::App* config_app =
      app.add_subcommand("config", "check a configuration and print it complete and annotated");
  add_common(*config_app, config_options);
  config_app->add_flag("--schema", config_options.schema,
                       "instead: the JSON Schema of every key, for editors of TOML");
  config_app->footer(
      footer("  photocoag config > my.toml\n"
             "  photocoag config --schema > photocoag.schema.json\n"
             "  photocoag config --config my.toml --set control.peak_reference_K=20"));
  config_app->callback([&] { exit_code = print_config(config_options); });

  EstimationOptions estimation_options;
  CLI::App* estimation_app = app.add_subcommand(
      "estimation", "how large the estimator's errors are over many eyes, and whether it knows");
  add_common(*estimation_app, estimation_options);
  add_cache(*estimation_app, estimation_options);
  estimation_app->add_option("--seeds", estimation_options.seeds, "treatments per scenario")
      ->check(whole_number_from(1, 100000))
      ->type_name("N");
  estimation_app
      ->add_option("--csv", estimation_options.csv,
                   "also every cycle's figures; - is standard output")
      ->type_name("FILE");
  estimation_app->add_flag(
      "--compare", estimation_options.compare,
      "instead: filter against moving horizon for one and two unknown absorption factors");
  estimation_app
      ->add_option("--out", estimation_options.out,
                   "with --compare: new folder for its CSV and figure")
      ->needs("--compare")
      ->type_name("DIR");
  estimation_app->footer(
      footer("  photocoag estimation\n"
             "  photocoag estimation --seeds 1000 --set estimator.power_process_noise_W=0\n"
             "  photocoag estimation --compare --config configs/two-unknowns.toml --out runs/mhe\n"
             "Eyes have the tissue of [plant]; their absorption factors are drawn."));
  estimation_app->callback([&] { exit_code = estimation(estimation_options); });

  FaultsOptions faults_options;
  CLI::App* faults_app = app.add_subcommand(
      "faults", "inject every fault of docs/safety.md and show how the supervisor reacts");
  faults_app->add_option("--row", faults_options.row, "one row, e.g. M4; default: all")
      ->type_name("ID");
  faults_app->add_flag("--without-supervisor", faults_options.without_supervisor,
                       "take the supervisor out: every row must fail");
  faults_app
      ->add_option("--healthy", faults_options.healthy,
                   "also so many treatments without faults, to count false stops")
      ->check(whole_number_from(1, 1000000))
      ->type_name("n");
  faults_app
      ->add_option("--kills", faults_options.kills,
                   "instead: SIGKILL so many controllers at random moments of a treatment of the "
                   "eye's process (row T4)")
      ->check(whole_number_from(1, 100000))
      ->type_name("n");
  faults_app
      ->add_option("--stops", faults_options.stops,
                   "the same with SIGSTOP, and SIGCONT after 20 ms (row T3)")
      ->check(whole_number_from(1, 100000))
      ->type_name("n");
  faults_app
      ->add_option("--allocation-step", faults_options.allocation_step,
                   "row X3: of the program's allocations every n-th fails, one at a time; 1: all")
      ->check(whole_number_from(1, 1000000))
      ->type_name("n");
  faults_app->footer(
      footer("  photocoag faults\n"
             "  photocoag faults --kills 100\n"
             "  photocoag faults --row M4\n"
             "  photocoag faults --healthy 10000\n"
             "  photocoag faults --without-supervisor"));
  faults_app->callback([&] { exit_code = faults_command(faults_options); });

  ReplayOptions replay_options;
  CLI::App* replay_app = app.add_subcommand(
      "replay", "feed a recorded run to the controller again and compare every power");
  replay_app->add_option("RUN", replay_options.run, "run folder")->required()->type_name("DIR");
  replay_app->add_flag("--no-cache", replay_options.no_cache, "make the reduced model anew");
  replay_app->footer(
      footer("  photocoag simulate --out runs/first\n"
             "  photocoag replay runs/first\n"
             "Same build, same machine: the same bits."));
  replay_app->callback([&] { exit_code = replay_command(replay_options); });

  add_machine_commands(app, exit_code);

  BenchOptions bench_options;
  CLI::App* bench_app = app.add_subcommand("bench", "measure computation times on this machine");
  bench_app
      ->add_option("NAME", bench_options.name,
                   "cycle: one control cycle and one step of the eye; qp: every solver on recorded "
                   "problems (the paper's Table 1); first-cycle: in 100 fresh processes")
      ->required()
      ->check(CLI::IsMember({"cycle", "qp", "first-cycle"}));
  bench_app
      ->add_option("--config", bench_options.config, "cycle: one more row, for this configuration")
      ->type_name("FILE");
  bench_app->add_option("--set", bench_options.set, "cycle: one key of that row, repeatable")
      ->type_name("KEY=VALUE");
  bench_app
      ->add_option("--json", bench_options.json, "also write the numbers; - is standard output")
      ->type_name("FILE");
  bench_app->add_option("--svg", bench_options.svg, "qp: also draw the medians over N")
      ->type_name("FILE");
  bench_app
      ->add_option("--export", bench_options.problems,
                   "qp: also write the recorded problems with their exact answers (JSON)")
      ->type_name("FILE");
  bench_app
      ->add_option("--repetitions", bench_options.repetitions, "qp: how often to time every step")
      ->check(whole_number_from(1, 1000))
      ->type_name("n");
  bench_app->add_flag("--one-process", bench_options.one_process,
                      "first-cycle: measure in this process only, print microseconds");
  bench_app->footer(
      footer("  photocoag bench cycle\n"
             "  photocoag bench cycle --config configs/uncertain-eye.toml\n"
             "  photocoag bench qp --json bench-qp.json --svg bench-qp.svg\n"
             "  photocoag bench first-cycle\n"
             "  ./photocoag bench model       full-order steps against sparse Cholesky; a program\n"
             "                                of its own in the source tree, see benchmarks/"));
  bench_app->callback([&] { exit_code = bench(bench_options); });

  SpotsOptions spots_options;
  CLI::App* spots_app = app.add_subcommand(
      "spots", "treat many random spots with the nominal and the robust controller");
  add_common(*spots_app, spots_options);
  spots_app->add_option("--count", spots_options.count, "spots; seeds 1 to count")
      ->check(whole_number_from(1, 1000000))
      ->type_name("n");
  spots_app->add_option("--alpha-low", spots_options.range.alpha_low, "smallest absorption factor")
      ->check(number_from(0.05, 5.0))
      ->type_name("a");
  spots_app->add_option("--alpha-high", spots_options.range.alpha_high, "largest")
      ->check(number_from(0.05, 5.0))
      ->type_name("a");
  spots_app->add_option("--csv", spots_options.csv, "one row per spot and controller")
      ->type_name("FILE");
  CLI::Option* corners =
      spots_app->add_flag("--corners", spots_options.corners,
                          "the robust controller at every combination of the declared extremes; "
                          "the worst six are treated --count times; exit code 1 if one of them "
                          "exceeds the limit more than twice and in more than 1 of 750");
  spots_app->add_option("--survey", spots_options.survey, "treatments of every corner")
      ->check(whole_number_from(2, 1000000))
      ->type_name("n")
      ->needs(corners);
  spots_app
      ->add_flag("--this-eye", spots_options.this_eye,
                 "the robust controller on the eye of [plant.tissue] alone, which the "
                 "controller is not told")
      ->excludes(corners);
  spots_app->footer(
      footer("  photocoag spots\n"
             "  photocoag spots --set control.period_ms=4 --set run.duration_ms=400\n"
             "  photocoag spots --set uncertainty.spot_radius_relative=0.1 --set "
             "uncertainty.thickness_relative=0.1 "
             "--set uncertainty.absorption_relative=0.1\n"
             "  photocoag spots --corners --count 1500 --set uncertainty.thickness_relative=0.1\n"
             "  photocoag spots --this-eye --set uncertainty.spot_radius_relative=0.1 --set "
             "plant.tissue.spot_radius_um=90\n"
             "The quantities of [uncertainty] are random too, and the robust controller is told."));
  spots_app->callback([&] { exit_code = spots_command(spots_options); });

  add_device_commands(app, exit_code);
  add_driver_check(app, exit_code);
  add_export_fmu(app, exit_code);
  add_study_commands(app, exit_code);
  add_full_commands(app, exit_code, argv);
  group_commands(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are a success; everything else is bad usage.
    return app.exit(error) == 0 ? 0 : kExitBadInput;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(refuse_to_go_on);
  prepare_console();
  int exit_code = kExitBadInput;
  try {
    exit_code = with_usual_stack([&] { return run_command(argc, argv); });
  } catch (const photocoag::Error& error) {
    say("photocoag: {}\n", error.what());
  } catch (const std::exception& error) {
    say("photocoag: unexpected failure: {}\n", error.what());
  }
  const bool printed = everything_printed();
  return exit_code == 0 && !printed ? kExitNotPrinted : exit_code;
}
