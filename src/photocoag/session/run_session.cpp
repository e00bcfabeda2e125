#include "photocoag/session/run_session.hpp"

#include <fmt/format.h>

#include <chrono>
#include <thread>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/rt/eye_link.hpp"
#include "photocoag/run/field.hpp"
#include "photocoag/run/recover.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "photocoag/run/treatment.hpp"
#include "photocoag/session/learning.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
constexpr const char* kJournal = "session.journal";

// A session's own folder, a new one or an empty one.
void claim(const Session& session, const fs::path& out) {
  if (fs::exists(out / kJournal)) return;
  const ClaimedFolder claimed(out);
  SessionJournal(out / kJournal, session);  // from here on the folder is this session's
}

// Where SCHED_FIFO or a core is asked for, it is there before anything begins.
void require_real_time_of(const Session& session) {
  const SafetySettings* asked = nullptr;
  for (const Config& config : session.configs) {
    if (asked != nullptr && *asked == config.safety) continue;
    require_real_time(config);
    asked = &config.safety;
  }
}

// Everything of a configuration that its models depend on.
Config of_models(Config config) {
  const Config plain;
  config.run = plain.run;
  config.control.peak_reference = plain.control.peak_reference;
  config.estimator.absorption_initial = config.estimator.absorption_min;
  config.estimator.absorption_sigma_initial = plain.estimator.absorption_sigma_initial;
  config.plant.absorption_factor = plain.plant.absorption_factor;
  config.plant.noise = plain.plant.noise;
  config.plant.bench = plain.plant.bench;
  return config;
}

/// One session that runs.
class Runner {
 public:
  Runner(const Session& session, const SessionOptions& options, const std::atomic<bool>& stop,
         std::atomic<std::size_t>& progress)
      : session_(session),
        options_(options),
        stop_(stop),
        progress_(progress),
        journal_((claim(session, options.out), options.out / kJournal), session) {}

  SessionResult run() {
    write_file((options_.out / "session.toml").string(), session_.text);
    complete_files();
    for (const std::string& name : options_.repeat) {
      journal_.repeat(session_.find(name, "--repeat"));
    }
    tell();
    for (std::size_t spot = 0; spot < session_.spots.size() && goes_on(); ++spot) {
      while (journal_.spots()[spot].wanted && goes_on()) visit(spot);
    }
    result_.spots = journal_.spots();
    result_.attempts = journal_.attempts();
    result_.energy = journal_.energy();
    return std::move(result_);
  }
  void was_continued(bool continued) { result_.continued = continued; }

 private:
  void tell() const {
    if (options_.ask.changed) options_.ask.changed(journal_);
  }
  bool goes_on() {
    if (stop_ && result_.end == SessionEnd::kComplete) {
      end(SessionEnd::kInterrupted, "stopped by hand");
    }
    return result_.end == SessionEnd::kComplete;
  }
  void end(SessionEnd how, std::string why) {
    result_.end = how;
    result_.why = std::move(why);
  }

  // Completes the files of interrupted spots from their logs.
  void complete_files() {
    for (const AttemptOutcome& attempt : journal_.attempts()) {
      const fs::path folder = options_.out / attempt.folder;
      if (attempt.ending != SpotEnding::kMayHaveEmitted || fs::exists(folder / "report.html")) {
        continue;
      }
      try {
        if (!fs::exists(folder / "summary.json")) recover_run(folder);
        write_report(folder);
      } catch (const Error&) {
        continue;  // killed before there was a log: nothing is known
      }
    }
  }

  bool within_limits(std::size_t spot) {
    const Config& config = session_.configs[spot];
    const SessionLimits& limits = session_.limits;
    const double energy = journal_.energy() + worst_energy(config);
    const double time = journal_.elapsed() + config.run.duration;
    const auto refuse = [&](std::string why) {
      end(SessionEnd::kLimit,
          fmt::format("spot {} is not begun: {}", session_.spots[spot].name, why));
      return false;
    };
    if (energy > limits.energy) {
      return refuse(fmt::format(
          "limits.energy_mJ = {:g}; {:.3g} mJ are counted and it may take {:.3g} mJ more",
          limits.energy * 1e3, journal_.energy() * 1e3, worst_energy(config) * 1e3));
    }
    if (time > limits.time) {
      return refuse(fmt::format("limits.time_s = {:g}; {:.1f} s have passed", limits.time,
                                journal_.elapsed()));
    }
    if (journal_.attempts().size() >= limits.spots) {
      return refuse(fmt::format("limits.spots = {}; so many have been begun", limits.spots));
    }
    return true;
  }

  void visit(std::size_t spot) {
    if (!within_limits(spot)) return;
    const SpotPlan& plan = session_.spots[spot];
    const std::optional<Error> trouble = prepare(spot);
    if (options_.ask.before) {
      using Before = SessionOperator::Before;
      const Before choice = options_.ask.before(plan);
      if (choice == Before::kEnd) return end(SessionEnd::kOperator, "ended by the operator");
      if (choice == Before::kSkip) {
        journal_.skip(spot);
        return tell();
      }
    }
    if (!journal_.attempts().empty()) pause();
    if (!goes_on()) return;
    if (trouble) return fail(plan, *trouble);
    const auto& still = options_.ask.still_wanted;
    if (options_.ask.before && still && !still()) return;
    const AttemptOutcome outcome = treat(spot);
    if (options_.ask.over) options_.ask.over(outcome);
    if (!ended_by(outcome)) return;
    if (options_.ask.after) {
      using After = SessionOperator::After;
      const After choice = options_.ask.after(outcome);
      if (choice == After::kEnd) end(SessionEnd::kOperator, "ended by the operator");
      if (choice == After::kRepeat) {
        journal_.repeat(spot);
        tell();
      }
    }
  }

  // A spot that cannot be prepared; before any other has been begun the input is wrong.
  void fail(const SpotPlan& plan, const Error& error) {
    if (journal_.attempts().empty()) throw Error(error);
    end(SessionEnd::kFailed, fmt::format("spot {}: {}", plan.name, error.what()));
  }

  // True if the session may go on after that.
  bool ended_by(const AttemptOutcome& outcome) {
    switch (outcome.ending) {
      case SpotEnding::kInterrupted:
        end(SessionEnd::kInterrupted, "stopped by hand");
        break;
      case SpotEnding::kDeviceFault:
        end(SessionEnd::kDeviceFault, fmt::format("spot {}: {}", outcome.spot, outcome.why));
        break;
      case SpotEnding::kStopped:
        if (!session_.ends_with_a_stop) break;
        end(SessionEnd::kStopped, fmt::format("spot {}: {}", outcome.spot, outcome.why));
        break;
      default:
        break;
    }
    return result_.end == SessionEnd::kComplete;
  }

  void pause() {
    using namespace std::chrono;
    const auto until = steady_clock::now() + duration<double>(session_.pause);
    while (!stop_ && steady_clock::now() < until) std::this_thread::sleep_for(milliseconds(5));
  }

  ModelStore& models_for(const Config& config) {
    if (!models_ || !(of_models(models_->config()) == of_models(config))) {
      models_ = std::make_unique<ModelStore>(config, options_.use_cache);
    }
    models_->reduced();
    if (config.plant.model == PlantModel::kFull && session_.place.here()) models_->plant_full();
    return *models_;
  }

  // All that takes long or may fail before the spot's intent.
  std::optional<Error> prepare(std::size_t spot) {
    config_ = session_.configs[spot];
    if (session_.learn) {
      config_.estimator = learnt(config_.estimator, journal_.attempts(), session_.learn_floor);
    }
    config_.run.seed += journal_.spots()[spot].attempts.size() * session_.spots.size();
    try {
      config_.validate();
      const ReducedModel& model = models_for(config_).reduced();
      controlled_ = controller_config(config_, model);
      if (options_.ask.prepared) options_.ask.prepared(session_.spots[spot], controlled_, model);
    } catch (const Error& error) {
      return error;
    }
    return {};
  }

  AttemptOutcome treat(std::size_t spot) {
    const int attempt = static_cast<int>(journal_.spots()[spot].attempts.size()) + 1;
    const std::string& name = session_.spots[spot].name;
    if (options_.ask.begins) options_.ask.begins(session_.spots[spot], config_, attempt);
    AttemptOutcome begun;
    begun.spot = name;
    begun.attempt = attempt;
    begun.folder = fmt::format("spots/{:03}-{}{}", spot + 1, name,
                               attempt > 1 ? fmt::format("-{}", attempt) : std::string());
    begun.ending = SpotEnding::kMayHaveEmitted;
    begun.why = "the program ended while the spot was treated";
    begun.energy_mJ = worst_energy(config_) * 1e3;
    begun.prior = config_.estimator.absorption_initial;
    begun.prior_sigma = config_.estimator.absorption_sigma_initial;
    journal_.intend(spot, begun);
    tell();
    AttemptOutcome outcome = begun;
    try {
      outcome = treat_in_folder(options_.out / begun.folder);
    } catch (const DeviceError& error) {
      outcome.ending = SpotEnding::kDeviceFault;
      outcome.why = error.what();
    } catch (const Error& error) {
      outcome.ending = SpotEnding::kInterrupted;
      outcome.why = error.what();
      end(SessionEnd::kFailed, fmt::format("spot {}: {}", name, error.what()));
    }
    outcome.spot = begun.spot;
    outcome.attempt = begun.attempt;
    outcome.folder = begun.folder;
    journal_.finish(spot, outcome);
    tell();
    return outcome;
  }

  AttemptOutcome treat_in_folder(const fs::path& folder) {
    const ClaimedFolder claimed = open_run_folder(folder, config_);
    const DeviceAddress& place = session_.place;
    // The next spot is at a cold place.
    if (place.eye() && !place.own_process) command_eye(place.path, "cold");
    progress_ = 0;
    const Treatment treatment =
        treat_into(folder, controlled_, place, *models_, stop_, progress_, options_.ask.monitor);
    if (options_.ask.treated) options_.ask.treated(config_, treatment, folder);
    AttemptOutcome outcome = outcome_of(config_, treatment);
    try {
      write_run(folder, config_, treatment);
      if (place.simulated()) write_field(folder, config_, treatment, *models_);
      write_report(folder);
      if (!treatment.log.trouble.empty()) throw Error(treatment.log.trouble);
    } catch (const Error& error) {
      end(SessionEnd::kFailed,
          fmt::format("the run folder {} is not complete: {}", folder.string(), error.what()));
    }
    return outcome;
  }

  const Session& session_;
  const SessionOptions& options_;
  const std::atomic<bool>& stop_;
  std::atomic<std::size_t>& progress_;
  SessionJournal journal_;
  std::unique_ptr<ModelStore> models_;
  Config config_;      // of the running spot …
  Config controlled_;  // … and what its controller is told
  SessionResult result_;
};

}  // namespace

SessionResult run_session(const Session& session, const SessionOptions& options,
                          const std::atomic<bool>& stop, std::atomic<std::size_t>& progress) {
  const bool continued = fs::exists(options.out / kJournal);
  if (session.place.kind != DeviceAddress::Kind::kVirtual) require_real_time_of(session);
  Runner runner(session, options, stop, progress);
  runner.was_continued(continued);
  return runner.run();
}

}  // namespace photocoag
