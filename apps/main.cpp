// The program `photocoag`: command line only. Commands are in commands.hpp.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <string_view>

#include "commands.hpp"
#include "device_commands.hpp"
#include "machine_commands.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "stack.hpp"
#include "study_commands.hpp"

namespace {

using namespace photocoag;

constexpr int kExitBadInput = 2;

void add_common(CLI::App& command, CommonOptions& options) {
  command.add_option("--config", options.config, "TOML file; without it the defaults")
      ->type_name("FILE");
  command
      .add_option("--set", options.set,
                  "one key of the configuration, e.g. control.horizon=10 or "
                  "tissue.layers.RPE.thickness_um=5; may be repeated, later ones win")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

void add_cache(CLI::App& command, CommonOptions& options) {
  command.add_flag("--no-cache", options.no_cache,
                   "make the reduced model anew (the result is the same to the last bit)");
}

void add_run(CLI::App& command, RunOptions& options) {
  add_common(command, options);
  add_cache(command, options);
  command
      .add_option("--out", options.out, "run folder, new or empty; default: a new one below runs/")
      ->type_name("DIR");
  command
      .add_option("--seed", options.seed, "seed of the measurement noise, same as --set run.seed=N")
      ->type_name("N");
}

std::string footer(std::string_view examples) {
  return fmt::format(
      "Examples:\n{}\n"
      "Exit code: 0 good; 1 finished but a check failed, or stopped; 2 bad input; 3 device "
      "fault.\n{}",
      examples, kResearchNotice);
}

/// Where an exception cannot be caught, as in a library's destructor that finds no memory. Programs
/// that hold a device replace it (rt/last_resort.hpp).
[[noreturn]] void refuse_to_go_on() noexcept {
  constexpr std::string_view kSaid = "photocoag: out of memory: the program ends\n";
  if (write(STDERR_FILENO, kSaid.data(), kSaid.size()) < 0) _exit(kExitBadInput);
  _exit(kExitBadInput);
}

int run_command(int argc, char** argv) {
  CLI::App app{
      "photocoag: real-time model predictive control of retinal laser treatment.\n"
      "Heats a spot of a simulated eye to a wanted peak temperature that cannot be measured, with "
      "a laser "
      "power computed every millisecond from a noisy volume temperature."};
  app.name("photocoag");
  app.set_version_flag("--version", fmt::format("photocoag {} (source {})\n{}", version(),
                                                source_hash(), kResearchNotice));
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

  ResponseOptions response_options;
  CLI::App* response_app = app.add_subcommand(
      "response",
      "temperatures after switching on a constant power, from the full or the reduced model");
  add_common(*response_app, response_options);
  add_cache(*response_app, response_options);
  response_app->add_option("--model", response_options.model, "full or reduced")
      ->required()
      ->check(CLI::IsMember({"full", "reduced"}));
  response_app
      ->add_option("--rom", response_options.rom, "reduced model file (with --model reduced)")
      ->type_name("FILE");
  response_app->add_option("--power", response_options.power, "laser power, W")
      ->required()
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("W");
  response_app
      ->add_option("--times", response_options.times, "times after switching on, s, by comma")
      ->required()
      ->delimiter(',')
      ->type_name("t1,t2,...");
  response_app->add_option("--csv", response_options.csv, "output file; - is standard output")
      ->type_name("FILE");
  response_app->footer(footer(
      "  photocoag response --model full --power 0.03 --times 0.001,0.01,0.1 --csv -\n"
      "  photocoag response --model reduced --rom model.json --power 1 --times 0.004 --csv -\n"
      "The eye is that of [plant]: its absorption_factor, tissue and discretization."));
  response_app->callback([&] { exit_code = response(response_options); });

  ReduceOptions reduce_options;
  CLI::App* reduce_app = app.add_subcommand(
      "reduce", "make a reduced model file from [tissue], measure and prove its error");
  add_common(*reduce_app, reduce_options);
  reduce_app
      ->add_option(
          "--out", reduce_options.out,
          "model file to write; - is standard output. With --compare: a folder for CSV and "
          "figure, or a .csv file; may be left out")
      ->type_name("FILE");
  reduce_app->add_flag("--compare", reduce_options.compare,
                       "no model: the error of every method against the order");
  reduce_app
      ->add_option("--method", reduce_options.method,
                   "same as --set model.method=M: pod-deim, balanced, balanced-two-sided, "
                   "irka, taylor")
      ->type_name("M");
  reduce_app
      ->add_option("--order", reduce_options.order, "same as --set model.order=n: states, 1 to 14")
      ->type_name("n");
  reduce_app->footer(
      footer("  photocoag reduce --out model.json\n"
             "  photocoag reduce --set control.period_ms=4 --order 8 --out model-250hz.json\n"
             "  photocoag reduce --compare --out comparison\n"
             "  photocoag simulate --set model.file=model.json"));
  reduce_app->callback([&] { exit_code = reduce_command(reduce_options); });

  FieldOptions field_options;
  CLI::App* field_app = app.add_subcommand(
      "field", "temperatures in all cells at chosen times as VTK files, for ParaView");
  add_common(*field_app, field_options);
  field_app
      ->add_option("--model", field_options.model,
                   "full, or reduced: the field of the reduced state, T = V x")
      ->check(CLI::IsMember({"full", "reduced"}));
  field_app->add_option("--power", field_options.power, "constant laser power, W")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("W");
  field_app->add_option("--run", field_options.run, "or the powers of this run folder")
      ->type_name("DIR");
  field_app
      ->add_option("--times", field_options.times,
                   "times, s, by comma: whole multiples of control.period_ms")
      ->required()
      ->delimiter(',')
      ->type_name("t1,t2,...");
  field_app->add_option("--out", field_options.out, "folder, new or empty")
      ->required()
      ->type_name("DIR");
  field_app->footer(
      footer("  photocoag field --power 0.03 --times 0.001,0.01,0.1 --out fields\n"
             "  photocoag field --model reduced --power 0.03 --times 0.1 --out reduced-fields\n"
             "  photocoag field --run runs/first --times 0.005,0.25 --out runs/first-fields\n"
             "The eye is that of [plant]. fields.pvd is the series of all times."));
  field_app->callback([&] { exit_code = field_command(field_options); });

  ExportOptions export_options;
  CLI::App* export_app = app.add_subcommand(
      "export",
      "write the full-order model as sparse matrices (Matrix Market), for other programs");
  add_common(*export_app, export_options);
  export_app->add_option("--out", export_options.out, "folder, new or empty")
      ->required()
      ->type_name("DIR");
  export_app
      ->add_option("--alphas", export_options.absorption_factors,
                   "absorption factors of the columns of B and the rows of C, by comma")
      ->required()
      ->delimiter(',')
      ->type_name("a1,a2,...");
  export_app->footer(
      footer("  photocoag export --alphas 0.5,0.7363,1.1 --out matrices\n"
             "Writes E.mtx, A.mtx, B.mtx, C.mtx, and validation.csv: the powers that reduce\n"
             "measures errors with and the full-order model's temperatures for them."));
  export_app->callback([&] { exit_code = export_command(export_options); });

  CommonOptions config_options;
  CLI::App* config_app =
      app.add_subcommand("config", "check a configuration and print it complete and annotated");
  add_common(*config_app, config_options);
  config_app->footer(
      footer("  photocoag config > my.toml\n"
             "  photocoag config --config my.toml --set control.peak_reference_K=20"));
  config_app->callback([&] { exit_code = print_config(config_options); });

  CommonOptions boundaries_options;
  CLI::App* boundaries_app = app.add_subcommand(
      "boundaries",
      "tell whether [tissue] is large enough: move each boundary out, compare the peak");
  add_common(*boundaries_app, boundaries_options);
  boundaries_app->footer(
      footer("  photocoag boundaries\n"
             "  photocoag boundaries --set tissue.domain_radius_um=1000"));
  boundaries_app->callback([&] { exit_code = boundaries(boundaries_options); });

  DiscretizationsOptions schemes_options;
  CLI::App* schemes_app = app.add_subcommand(
      "discretizations",
      "what implicit Euler (the paper's) and TR-BDF2 miss of the first steps, at 1 and at 4 ms");
  add_common(*schemes_app, schemes_options);
  schemes_app
      ->add_option("--out", schemes_options.out, "folder for CSV and figure; may be left out")
      ->type_name("DIR");
  schemes_app->footer(
      footer("  photocoag discretizations --set plant.absorption_factor=0.7363\n"
             "  photocoag discretizations --out runs/discretizations\n"
             "The eye is that of [plant]: its absorption_factor and tissue."));
  schemes_app->callback([&] { exit_code = discretizations(schemes_options); });

  EstimationOptions estimation_options;
  CLI::App* estimation_app = app.add_subcommand(
      "estimation", "how large the estimator's errors are over many eyes, and whether it knows");
  add_common(*estimation_app, estimation_options);
  add_cache(*estimation_app, estimation_options);
  estimation_app->add_option("--seeds", estimation_options.seeds, "treatments per scenario")
      ->check(CLI::Range(1, 100000))
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
      ->check(CLI::Range(0, 1000000))
      ->type_name("n");
  faults_app
      ->add_option("--kills", faults_options.kills,
                   "instead: SIGKILL so many controllers at random moments of a treatment of the "
                   "eye's process (row T4)")
      ->check(CLI::Range(0, 100000))
      ->type_name("n");
  faults_app
      ->add_option("--stops", faults_options.stops,
                   "the same with SIGSTOP, and SIGCONT after 20 ms (row T3)")
      ->check(CLI::Range(0, 100000))
      ->type_name("n");
  faults_app
      ->add_option("--allocation-step", faults_options.allocation_step,
                   "row X3: of the program's allocations every n-th fails, one at a time; 1: all")
      ->check(CLI::Range(1, 1000000))
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
      ->check(CLI::Range(1, 1000))
      ->type_name("n");
  bench_app->add_flag("--one-process", bench_options.one_process,
                      "first-cycle: measure in this process only, print microseconds");
  bench_app->footer(
      footer("  photocoag bench cycle\n"
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
      ->check(CLI::Range(1, 1000000))
      ->type_name("n");
  spots_app->add_option("--alpha-low", spots_options.range.alpha_low, "smallest absorption factor")
      ->check(CLI::Range(0.05, 5.0))
      ->type_name("a");
  spots_app->add_option("--alpha-high", spots_options.range.alpha_high, "largest")
      ->check(CLI::Range(0.05, 5.0))
      ->type_name("a");
  spots_app->add_option("--csv", spots_options.csv, "one row per spot and controller")
      ->type_name("FILE");
  spots_app->add_flag("--corners", spots_options.corners,
                      "the robust controller at every combination of the declared extremes, "
                      "--count treatments each");
  spots_app->footer(
      footer("  photocoag spots\n"
             "  photocoag spots --set control.period_ms=4 --set run.duration_ms=400\n"
             "  photocoag spots --set uncertainty.spot_radius_relative=0.1 --set "
             "uncertainty.thickness_relative=0.1 "
             "--set uncertainty.absorption_relative=0.1\n"
             "  photocoag spots --corners --count 100 --set uncertainty.thickness_relative=0.1\n"
             "The quantities of [uncertainty] are random too, and the robust controller is told."));
  spots_app->callback([&] { exit_code = spots_command(spots_options); });

  add_device_commands(app, exit_code);
  add_study_commands(app, exit_code);

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
  try {
    return with_usual_stack([&] { return run_command(argc, argv); });
  } catch (const photocoag::Error& error) {
    fmt::print(stderr, "photocoag: {}\n", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "photocoag: unexpected failure: {}\n", error.what());
    return kExitBadInput;
  }
}
