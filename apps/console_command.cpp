// `photocoag console`: one page to treat with, live in the browser.
#include "console_command.hpp"

#include <fmt/format.h>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "console_parts.hpp"
#include "console_session.hpp"
#include "options.hpp"
#include "photocoag/console/describe.hpp"
#include "photocoag/console/desk.hpp"
#include "photocoag/console/server.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/realtime_check/doctor.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/field.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "photocoag/run/treatment.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Common data of all spots. `config` changes only its seed from spot to spot.
struct Bench {
  Config config;
  Config controlled;  // with its margin
  DeviceAddress place;
  ModelStore& models;
  fs::path out;
  int spots = 0;
  int stopped = 0;
};

ClaimedFolder folder_of_spot(const Bench& bench) {
  if (bench.out.empty()) return open_new_run_folder(bench.config);
  return open_run_folder(bench.out / fmt::format("spot-{:03}", bench.spots), bench.config);
}

Treatment treat_spot(Bench& bench, Desk& desk, const fs::path& folder) {
  const TreatmentMonitor monitor{
      .live = &desk.live(),
      .self_tested = [&desk](const SelfTestReport& report, const SafetyLimits& limits) {
        desk.self_tested(report, limits);
      }};
  std::atomic<std::size_t> done{0};
  return treat_into(folder, bench.controlled, bench.place, bench.models, stop_requested(), done,
                    monitor);
}

// Writes what it can of the run folder; returns the first failure as text.
std::string write_spot(Bench& bench, const fs::path& folder, const Treatment& treatment) {
  try {
    write_run(folder, bench.config, treatment);
    if (bench.place.simulated()) {
      write_field(folder, bench.config, treatment, bench.models);
    }
    write_report(folder);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

void spot(Bench& bench, Desk& desk) {
  if (!desk.commit()) return;
  ++bench.spots;
  const ClaimedFolder claimed = folder_of_spot(bench);
  desk.begin({.number = bench.spots, .planned_cycles = bench.config.cycles()});
  say("spot {:<4} {}\n", bench.spots, claimed.path().string());
  Treatment treatment;
  std::string failure;
  SpotEnd end{.state = SafetyState::kSafeStop, .message = {}, .folder = claimed.path()};
  try {
    treatment = treat_spot(bench, desk, claimed.path());
    end.state = treatment.outcome.safety.state;
    end.reason = treatment.outcome.safety.reason;
    // Without a supervisor the state is not set.
    if (end.state == SafetyState::kTreating) end.state = SafetyState::kDone;
    desk.over(end.state, end.reason);
    if (const std::string trouble = write_spot(bench, claimed.path(), treatment);
        !trouble.empty()) {
      say("ALARM     the run folder is not complete: {}\n", trouble);
    }
    if (!treatment.log.trouble.empty()) say("ALARM     {}\n", treatment.log.trouble);
  } catch (const Error& error) {
    failure = error.what();
    end.reason = SafetyReason::kSelfTest;
    say("photocoag: {}\n", failure);
  }
  bench.stopped += treatment.outcome.stopped || !failure.empty() ? 1 : 0;
  end.message = spot_message(bench.config, treatment, bench.spots, claimed.path(), failure);
  say("          {}, {} cycles, {} overruns\n", to_string(end.state), treatment.outcome.cycles,
      treatment.outcome.overruns);
  desk.end(std::move(end));
  // The next spot's noise is another one.
  bench.config.run.seed = bench.controlled.run.seed = bench.config.run.seed + 1;
}

// STANDBY, by a self-test where the eye is at hand.
void prepare_spot(Bench& bench, Desk& desk) {
  if (!bench.place.here() || !bench.config.safety.supervised) return desk.stand_by();
  desk.self_tested(self_test_eye(bench.controlled, true), safety_limits(bench.controlled));
}

int serve(Bench& bench, Desk& desk, const ConsoleServer& server) {
  Terminal terminal;
  prepare_spot(bench, desk);
  bool seen_dead = false;
  while (stop_requests() == 0) {
    if (!server.alive()) {
      say("photocoag: the server has ended; no further spot starts\n");
      seen_dead = true;
      break;
    }
    if (terminal.enter()) desk.enter();
    switch (desk.wait(kConsolePoll)) {
      case Desk::Wish::kStart:
        spot(bench, desk);
        break;
      case Desk::Wish::kReset:
        prepare_spot(bench, desk);
        break;
      case Desk::Wish::kChoice:  // of sessions
      case Desk::Wish::kNone:
        break;
    }
  }
  say("console   {} spots, {} stopped; the server refused {} requests\n", bench.spots,
      bench.stopped, server.refusals().total());
  const bool during = desk.state() == SafetyState::kSafeStop || bench.stopped > 0;
  return seen_dead || during ? 1 : 0;
}

int run_console(const ConsoleOptions& options) {
  if (!options.session.empty()) return console_session(options);
  const DeviceAddress place =
      options.device.empty() ? DeviceAddress() : parse_device(options.device);
  const Config config = for_device(configured(use_of(place), options.config, options.set), place);
  if (!options.out.empty()) check_run_folder(options.out);
  require_real_time(config);

  say("photocoag {}: {}\n", version(), kResearchNotice);
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  const ReducedModel& model = models.reduced();
  if (config.plant.model == PlantModel::kFull && place.here()) models.plant_full();
  clear_progress();
  Config controlled = config;
  if (wants_margin(config)) controlled = backed_off(config, tissue_margin(config, model));

  const ConsoleDevice what = console_device(config, place);
  Desk desk({.browser_starts = what.browser_starts,
             .foxglove = options.foxglove,
             .period = config.control.period,
             .stop = ask_to_stop,
             .resume = forget_stop,
             .before = before_message(controlled, model, what, examine(own_privileges()))});
  const ConsoleServer server(console_settings(options), console_hooks(desk));
  stop_on_signals();
  say_address(options, server, what.browser_starts);
  Bench bench{.config = config,
              .controlled = controlled,
              .place = place,
              .models = models,
              .out = options.out};
  return serve(bench, desk, server);
}

const Command kConsole(
    "console", "treat live in the browser, spot after spot: a page served to this machine only",
    run_console, [](CommandLine& command, ConsoleOptions& options) {
      add_common(command, options);
      add_cache(command, options);
      const CommandOption device =
          command.add_option("--device", options.device, "as for treat; default: a simulated eye")
              .type_name("DEVICE");
      command
          .add_option(
              "--session", options.session,
              "the spots of a session file (docs/sessions.md) in the folder of --out, which "
              "is continued")
          .type_name("FILE")
          .excludes(device)
          .excludes("--config")
          .excludes("--set");
      command.add_option("--port", options.port, "on 127.0.0.1; default: any that is free")
          .check(whole_number_from(0, 65535))
          .type_name("P");
      const CommandOption foxglove = command.add_flag(
          "--foxglove", options.foxglove,
          "also a stream for Foxglove, Lichtblick, PlotJuggler (foxglove.sdk.v1, .websocket.v1)");
      command
          .add_option("--foxglove-origin", options.foxglove_origins,
                      "origin of a page that may connect to it, e.g. https://app.foxglove.dev; may "
                      "be repeated")
          .type_name("ORIGIN")
          .one_value_each()
          .needs(foxglove);
      command
          .add_option(
              "--out", options.out,
              "folder, new or empty, for the spots' run folders; default: new ones below runs/")
          .type_name("DIR");
      command.footer(
          footer("  photocoag console\n"
                 "  photocoag console --port 8080 --set run.duration_ms=10000\n"
                 "  photocoag console --device eye\n"
                 "  photocoag console --session studies/sessions/grid.toml --out runs/grid\n"
                 "Open the address it prints; it holds a token. The browser can stop; it can "
                 "start only a simulated eye."));
    });

}  // namespace

}  // namespace photocoag
