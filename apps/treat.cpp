// `photocoag treat` and `photocoag simulate`: one closed-loop treatment, by the clock or in virtual
// time.
#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "model_report.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/field.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/reasons.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "photocoag/run/treatment.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr int kExitDeviceFault = 3;

struct RunOptions : CommonOptions {
  std::string out;                  ///< run folder; empty: a new one below runs/
  std::string seed;                 ///< as given; empty: from the configuration
  std::string device;               ///< of `treat`: empty, or see run/device_address.hpp
  std::vector<std::string> faults;  ///< of an eye that `treat` starts itself
  bool json = false;                ///< the outcome as JSON on standard output
};

void print_outcome(const Config& config, const Treatment& treatment, const fs::path& folder) {
  const RunSummaryNumbers numbers = summarize(config, treatment);
  if (!numbers.stopped_for.empty()) {
    const bool dark = numbers.dark_since < treatment.records.size();
    say("STOPPED   {}: {}\n", numbers.stopped_for,
        dark ? fmt::format("the laser is at 0 W since cycle {}", numbers.dark_since)
             : std::string("light in the last cycle recorded"));
    if (const SafetyReason reason = treatment.outcome.safety.reason;
        reason != SafetyReason::kNone) {
      const ReasonWords words = words_of(reason);
      say("          {}{}{}\n", words.what, words.then.empty() ? "" : " ", words.then);
    }
    if (treatment.device && !treatment.device->status.empty()) {
      say("          device: {}\n", treatment.device->status);
    }
  }
  if (!numbers.truth_known) {
    say("result    estimated peak at most {:.2f} K, limit {:g} K; the true one is not known\n",
        numbers.peak_estimate_max, numbers.limit);
  } else {
    say("result    peak at most {:.2f} K, limit {:g} K {}\n", numbers.peak_true_max, numbers.limit,
        numbers.limit_violations == 0
            ? std::string("not exceeded")
            : fmt::format("EXCEEDED in {} cycles", numbers.limit_violations));
  }
  if (numbers.time_to_95_percent) {
    say("          95 % of {:g} K after {:g} ms", config.control.peak_reference,
        *numbers.time_to_95_percent * 1e3);
  } else {
    say("          95 % of {:g} K {}", config.control.peak_reference,
        numbers.truth_known ? "never reached" : "not known to be reached");
  }
  if (numbers.rms_error_after_50_ms) {
    say("; RMS error after 50 ms {:.2f} K", *numbers.rms_error_after_50_ms);
  }
  say("\n");
  if (!treatment.records.empty()) {
    say("          absorption factor {:.3f} estimated{}\n",
        treatment.records.back().estimate.absorption_factor,
        numbers.absorption_error_final
            ? fmt::format(", {:g} true ({:+.1f} %)", config.plant.absorption_factor,
                          100.0 * *numbers.absorption_error_final)
            : std::string());
  }
  if (numbers.choroid_error_final) {
    say("          choroid factor {:.3f} estimated, {:g} true ({:+.1f} %)\n",
        treatment.records.back().estimate.choroid_factor, config.plant.choroid_factor,
        100.0 * *numbers.choroid_error_final);
  }
  if (treatment.prior_check && treatment.prior_check->doubtful()) {
    say("PRIOR     the samples of this eye do not fit [[prior]]: the stated probability may not "
        "hold\n");
  }
  const std::int64_t late = treatment.outcome.safety.late_commands;
  say("          {} cycles, {} overruns, {}{:.1f} ms of loop time{}{}\n", treatment.outcome.cycles,
      treatment.outcome.overruns, late > 0 ? fmt::format("{} commands late, ", late) : "",
      treatment.wall_seconds * 1e3, treatment.scheduling.empty() ? "" : ", ", treatment.scheduling);
  if (treatment.outcome.overruns > 0) {
    say("          in an overrun the last power is held; photocoag doctor says what makes one\n");
  }
  if (treatment.device && treatment.device->lockstep) {
    say("pacing    {}\n", treatment.device->pacing);
  }
  if (config.run.goal != Goal::kDuration) {
    say("goal      {}: {:g} ms held, thermal dose {:.3g}\n",
        treatment.outcome.goal_reached ? "reached" : "NOT reached", treatment.goal.held() * 1e3,
        treatment.goal.dose());
  }
  if (!treatment.log.trouble.empty()) {
    say("ALARM     the log is not complete: {}\n", treatment.log.trouble);
  }
  const std::filesystem::path report = folder / "report.html";
  if (std::filesystem::exists(report)) say("report    {}\n", report.string());
}

void print_margin(const TissueMargin& margin, const Config& controlled) {
  say("margin    of {} eyes the worst reaches {:.2f} K ({})\n"
      "          reference and limit times {:.3f}, {:.2f} K and {:.2f} K{}: then {:.2f} K\n",
      margin.eyes, margin.peak_unprotected, margin.worst, margin.factor,
      controlled.control.peak_reference, controlled.control.peak_max,
      margin.shares.empty()
          ? std::string()
          : fmt::format(", in the first period {:.3f} and in the last {:.3f} of that",
                        margin.shares.front(), margin.shares.back()),
      margin.peak_protected);
}

int run(const RunOptions& options, DeviceAddress place) {
  std::vector<std::string> overrides = options.set;
  if (!options.seed.empty()) overrides.push_back("run.seed=" + options.seed);
  place.faults = options.faults;
  const bool paced = place.kind != DeviceAddress::Kind::kVirtual;
  const Config config = for_device(configured(use_of(place), options.config, overrides), place);
  if (!options.faults.empty() && !place.own_process) {
    throw Error(ErrorParts{.where = "--fault", .accepted = "together with --device eye"});
  }
  if (!options.out.empty()) check_run_folder(options.out);
  if (paced) require_real_time(config);

  say("photocoag {}: {}\n", version(), kResearchNotice);
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  const ReducedModel& model = models.reduced();
  if (config.plant.model == PlantModel::kFull && place.here()) models.plant_full();
  clear_progress();
  print_error_report(model);
  if (!place.here()) {
    say("device    {}\n", options.device);
  } else {
    say("eye       {}, absorption factor {:g} (the controller is not told)\n",
        config.plant.model == PlantModel::kFull
            ? fmt::format("full order, {} states", models.plant_full()->states())
            : std::string("reduced model"),
        config.plant.absorption_factor);
  }

  Config controlled = config;
  if (wants_margin(config)) {
    const TissueMargin margin = tissue_margin(config, model);
    controlled = backed_off(config, margin);
    if (margin.needed() || config.uncertainty.declared()) print_margin(margin, controlled);
  }
  if (!config.safety.supervised) {
    say("WARNING   no supervisor (safety.supervisor = off)\n");
  } else if (paced && config.safety.real_time == RealTimeMode::kObserve) {
    say("observe   real time is not enforced: for a simulated eye only\n");
  }

  // From here on the run folder is claimed.
  const ClaimedFolder claimed =
      options.out.empty() ? open_new_run_folder(config) : open_run_folder(options.out, config);
  const fs::path& folder = claimed.path();
  stop_on_signals();
  std::atomic<std::size_t> done{0};
  Treatment treatment;
  {
    const ProgressMeter meter(paced ? "treating" : "simulating", done, config.cycles());
    treatment = treat_into(folder, controlled, place, models, stop_requested(), done);
  }
  bool complete = true;
  try {
    write_run(folder, config, treatment);
    if (place.simulated()) write_field(folder, config, treatment, models);
    write_report(folder);
  } catch (const Error& error) {
    complete = false;  // the treatment is over: keep what could be written
    say("photocoag: the run folder is not complete: {}\n", error.what());
  }
  print_outcome(config, treatment, folder);
  const bool good = !treatment.outcome.stopped && complete && treatment.log.trouble.empty();
  const bool fault = !place.here() && is_device_fault(treatment.outcome.safety.reason);
  return with_json(options.json, paced ? "treat" : "simulate",
                   fault  ? kExitDeviceFault
                   : good ? 0
                          : 1,
                   folder, summary_object(summary_json(config, treatment)));
}

int treat(const RunOptions& options) {
  try {
    return run(options, options.device.empty() ? DeviceAddress() : parse_device(options.device));
  } catch (const DeviceError& error) {
    say("photocoag: {}\n", error.what());
    return kExitDeviceFault;
  }
}

int simulate(const RunOptions& options) { return run(options, virtual_eye()); }

void add_run(CommandLine& command, RunOptions& options) {
  add_common(command, options);
  add_cache(command, options);
  command
      .add_option("--out", options.out, "run folder, new or empty; default: a new one below runs/")
      .type_name("DIR");
  command
      .add_option("--seed", options.seed, "seed of the measurement noise, same as --set run.seed=N")
      .check(given())
      .type_name("N");
  add_json(command, options.json);
}

const Command kTreat(
    "treat", "treat a simulated eye in real time (the main job); writes a run folder with a report",
    treat, [](CommandLine& command, RunOptions& options) {
      add_run(command, options);
      command.add_option("--device", options.device, kDeviceHelp).type_name("DEVICE");
      command
          .add_option("--fault", options.faults,
                      "with --device eye: ID@cycle[+count][*value] of docs/devices.md, or a file")
          .type_name("FAULT")
          .one_value_each();
      command.footer(
          footer("  photocoag treat\n"
                 "  photocoag treat --device eye\n"
                 "  photocoag treat --device eye --fault M2@120\n"
                 "  photocoag treat --config configs/paper-250hz-a.toml --seed 7 --out runs/first\n"
                 "Ctrl-C puts the laser to 0 W and still writes the run folder."));
    });

const Command kSimulate(
    "simulate",
    "the same treatment in virtual time, as fast as it can; same bytes for the same seed", simulate,
    [](CommandLine& command, RunOptions& options) {
      add_run(command, options);
      command.footer(footer(
          "  photocoag simulate --config configs/paper-1khz.toml --set "
          "plant.absorption_factor=0.5\n"
          "  photocoag simulate --set plant.tissue.spot_radius_um=90 --out runs/smaller-spot\n"
          "  photocoag simulate --config runs/first/config.toml      (repeats a run)"));
    });

}  // namespace

}  // namespace photocoag
