#include "commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "configured.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/config/schema.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/step_response.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/certificate.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/mor/uncertain_fit.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/run/boundaries.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/device_treatment.hpp"
#include "photocoag/run/field.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "photocoag/run/treat_into.hpp"
#include "photocoag/run/treatment.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr int kExitDeviceFault = 3;

Progress progress_bar(std::string label) {
  return
      [label](std::string_view stage, double fraction) { draw_progress(label, fraction, stage); };
}

void print_error_report(const ReducedModel& model) {
  say("model     {}{}, order {}, for {:g} ms; largest error {:.2f} % of the peak, {:.2f} % of the "
      "volume temperature (absorption factor {:g} to {:g}{})\n",
      model.method, model.refinement == "none" ? "" : ", refined", model.order(),
      model.period * 1e3, 100.0 * model.error.peak_max(), 100.0 * model.error.volume_max(),
      model.absorption_min, model.absorption_max,
      model.parameters == 1
          ? ""
          : fmt::format(", choroid factor {:g} to {:g}", model.choroid_min, model.choroid_max));
}

// One line per alpha; with two parameters one per beta, the worst of all alpha.
void print_error_table(const ErrorReport& error) {
  const bool two = !error.choroid_factors.empty();
  say("{}peak error %  volume error %   ({}constant and random on/off power, {:g} ms)\n",
      two ? "beta      " : "alpha     ", two ? "worst of all alpha; " : "", error.duration * 1e3);
  const std::vector<double>& along = two ? error.choroid_factors : error.absorption_factors;
  for (std::size_t i = 0; i < along.size();) {
    const double at = along[i];
    double peak = 0.0;
    double volume = 0.0;
    for (; i < along.size() && along[i] == at; ++i) {
      peak = std::max(peak, error.peak[i]);
      volume = std::max(volume, error.volume[i]);
    }
    say("{:5.2f}     {:12.3f}  {:14.3f}\n", at, 100.0 * peak, 100.0 * volume);
  }
}

void print_certificate(const ReducedModel& model) {
  if (!model.certificate) {
    say("no bound  {}\n", why_uncertified(model.discretization));
    return;
  }
  const ErrorCertificate& certificate = *model.certificate;
  say("proved    cold start, any power from 0 to u_max: within {:.2f} % (peak) and {:.2f} % "
      "(volume) of what u_max reaches in the end; in the first {:g} ms {:.2f} % and {:.2f} %\n",
      100.0 * certificate.peak.relative_max(), 100.0 * certificate.volume.relative_max(),
      certificate.treatment_duration * 1e3, 100.0 * certificate.peak.treatment_relative_max(),
      100.0 * certificate.volume.treatment_relative_max());
}

void print_outcome(const Config& config, const Treatment& treatment, const fs::path& folder) {
  const RunSummaryNumbers numbers = summarize(config, treatment);
  if (!numbers.stopped_for.empty()) {
    const bool dark = numbers.dark_since < treatment.records.size();
    say("STOPPED   {}: {}\n", numbers.stopped_for,
        dark ? fmt::format("the laser is at 0 W since cycle {}", numbers.dark_since)
             : std::string("light in the last cycle recorded"));
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
    say("PRIOR     what this eye showed does not fit [[prior]]: the stated probability may not "
        "hold\n");
  }
  const std::int64_t late = treatment.outcome.safety.late_commands;
  say("          {} cycles, {} overruns, {}{:.1f} ms of loop time{}{}\n", treatment.outcome.cycles,
      treatment.outcome.overruns, late > 0 ? fmt::format("{} commands late, ", late) : "",
      treatment.wall_seconds * 1e3, treatment.scheduling.empty() ? "" : ", ", treatment.scheduling);
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

int run(const RunOptions& options, Pacing pacing) {
  std::vector<std::string> overrides = options.set;
  if (!options.seed.empty()) overrides.push_back("run.seed=" + options.seed);
  TreatmentPlace place{.pacing = pacing, .faults = options.faults};
  if (!options.device.empty()) place.device = parse_device(options.device);
  const std::optional<DeviceAddress>& device = place.device;
  Config config = configured(use_of(place), options.config, overrides);
  if (device) config = for_device(config, *device);
  if (!options.faults.empty() && !(device && device->own_process)) {
    throw Error(ErrorParts{.where = "--fault", .accepted = "together with --device eye"});
  }
  if (!options.out.empty()) check_run_folder(options.out);
  if (pacing == Pacing::kClock) require_real_time(config);

  say("photocoag {}: {}\n", version(), kResearchNotice);
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  const ReducedModel& model = models.reduced();
  if (config.plant.model == PlantModel::kFull && !device) models.plant_full();
  clear_progress();
  print_error_report(model);
  if (device) {
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
  } else if (pacing == Pacing::kClock && config.safety.real_time == RealTimeMode::kObserve) {
    say("observe   real time is not enforced: for a simulated eye only\n");
  }

  // From here on the run has a place, whatever happens later.
  const ClaimedFolder claimed =
      options.out.empty() ? open_new_run_folder(config) : open_run_folder(options.out, config);
  const fs::path& folder = claimed.path();
  stop_on_signals();
  std::atomic<std::size_t> done{0};
  Treatment treatment;
  {
    const ProgressMeter meter(pacing == Pacing::kClock ? "treating" : "simulating", done,
                              config.cycles());
    treatment = treat_into(folder, controlled, place, models, stop_requested(), done);
  }
  bool complete = true;
  try {
    write_run(folder, config, treatment);
    if (!device || device->eye()) write_field(folder, config, treatment, models);
    write_report(folder);
  } catch (const Error& error) {
    complete = false;  // the treatment is over: what could be written is there
    say("photocoag: the run folder is not complete: {}\n", error.what());
  }
  print_outcome(config, treatment, folder);
  const bool good = !treatment.outcome.stopped && complete && treatment.log.trouble.empty();
  const bool fault = device && is_device_fault(treatment.outcome.safety.reason);
  return with_json(options.json, pacing == Pacing::kClock ? "treat" : "simulate",
                   fault  ? kExitDeviceFault
                   : good ? 0
                          : 1,
                   folder, summary_object(summary_json(config, treatment)));
}

}  // namespace

int treat(const RunOptions& options) {
  try {
    return run(options, Pacing::kClock);
  } catch (const DeviceError& error) {
    say("photocoag: {}\n", error.what());
    return kExitDeviceFault;
  }
}

int simulate(const RunOptions& options) { return run(options, Pacing::kVirtualTime); }

int response(const ResponseOptions& options) {
  const Config config =
      configured(options.model == "full" ? Use::kResponseFull : Use::kResponseReduced,
                 options.config, options.set);
  ascending_times(options.times);  // refuse bad times before the models are built
  if (options.model == "full" && !options.rom.empty()) {
    throw Error(ErrorParts{.where = "--rom",
                           .found = options.rom,
                           .accepted = "a model file together with --model reduced"});
  }
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  std::vector<Outputs> outputs;
  const AbsorptionFactors absorption = config.plant.absorption();
  if (options.model == "full") {
    FullOrderPlant plant(models.plant_full(), config.plant.discretization, config.control.period,
                         absorption, 0.0);
    outputs = sample_step_response(plant, config.plant.discretization, config.control.period,
                                   options.power, options.times);
  } else {
    const ReducedModel model =
        options.rom.empty() ? models.reduced() : load_reduced_model(options.rom);
    clear_progress();
    ReducedPlant plant(model, absorption);
    outputs = sample_step_response(plant, model.discretization, model.period, options.power,
                                   options.times);
  }
  std::string csv = "time_s,peak_K,volume_K\n";
  for (std::size_t i = 0; i < options.times.size(); ++i) {
    fmt::format_to(std::back_inserter(csv), "{},{},{}\n", options.times[i], outputs[i].peak,
                   outputs[i].volume);
  }
  write_output(options.csv, csv);
  return 0;
}

int reduce_command(const ReduceOptions& options) {
  if (options.compare) return compare_command(options);
  if (options.out.empty()) {
    throw Error(ErrorParts{.where = "--out",
                           .problem = "missing",
                           .accepted = "a model file to write, or - for standard output"});
  }
  if (options.json && options.out == "-") {
    throw Error(ErrorParts{
        .where = "--out", .found = "-", .accepted = "a file: --json has standard output"});
  }
  std::vector<std::string> overrides = options.set;
  if (!options.method.empty()) overrides.push_back("model.method=" + options.method);
  if (!options.order.empty()) overrides.push_back("model.order=" + options.order);
  const Config config = configured(Use::kReduce, options.config, overrides);
  const auto full = std::make_shared<const FullOrderModel>(config.tissue, config.grid);
  ReducedModel model = reduce(full, config.model.reduction, config.control.period,
                              config.model.discretization, progress_bar("reducing"));
  if (config.believes()) {
    model.uncertain = std::make_shared<const UncertainModel>(fit_uncertain_model(
        config.tissue, config.grid, config.estimator.prior, config.control.period));
  }
  clear_progress();
  write_output(options.out, to_json(model));
  say("photocoag {}: {}\n", version(), kResearchNotice);
  say("full      {} states ({} radial x {} axial cells)\n", full->states(),
      full->grid().radial.cells(), full->grid().axial.cells());
  print_error_report(model);
  print_certificate(model);
  print_error_table(model.error);
  if (model.uncertain) {
    const UncertainModel& u = *model.uncertain;
    say("uncertain {} quantities, {} modes; of a step response, rms and largest: {:.2f} and {:.2f} "
        "% "
        "of the peak, {:.2f} and {:.2f} % of the volume temperature\n",
        u.count(), u.order(), 100.0 * u.peak_error_rms, 100.0 * u.peak_error_max,
        100.0 * u.volume_error_rms, 100.0 * u.volume_error_max);
  }
  if (options.out != "-") say("written   {}\n", options.out);
  return with_json(options.json, "reduce", 0, {}, reduction_object(model, *full, options.out));
}

int boundaries(const CommonOptions& options) {
  const Config config = configured(Use::kBoundaries, options.config, options.set);
  constexpr double kSteady =
      1000.0;  // s: many times the slowest time constant of any sensible domain
  constexpr double kLarge = 0.01;
  const std::vector<double> times = {0.1, 0.4, kSteady};
  const std::vector<BoundaryEffect> effects =
      boundary_effects(config.tissue, config.grid, config.plant.absorption(), times);
  print("Change of the peak gain when a boundary (zero temperature rise) moves out, %\n");
  print("{:<8} {:<30} {:>8} {:>8} {:>8}\n", "boundary", "moved", "100 ms", "400 ms", "steady");
  bool large = false;
  for (const BoundaryEffect& effect : effects) {
    print("{:<8} {:<30}", effect.boundary, effect.moved);
    for (const double change : effect.change) {
      print(" {:8.2f}", 100.0 * change);
      large = large || std::abs(change) > kLarge;
    }
    print("\n");
  }
  if (large) {
    say("warning   a change above 1 %: the model's long treatments are too cold by so much, and "
        "its "
        "reference power too high; move that boundary out (the front: a layer of vitreous)\n");
  }
  return 0;
}

int print_config(const ConfigOptions& options) {
  if (options.schema) {
    write_output("-", config_schema());
    return 0;
  }
  write_output("-", to_toml(load_config(options.config, options.set)));
  return 0;
}

}  // namespace photocoag
