#include "photocoag/run/treatment.hpp"

#include <fmt/format.h>
#include <sys/prctl.h>

#include <exception>
#include <optional>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/run/eye_process.hpp"
#include "photocoag/run/treat.hpp"
#include "photocoag/run/treatment_log.hpp"

namespace photocoag {
namespace {

Treatment with_room(const Config& config) {
  Treatment treatment;
  treatment.records.resize(config.cycles());
  return treatment;
}

// Calls run(granted) on a new thread with the real-time scheduling that the system grants;
// rethrows.
template <typename F>
void on_a_real_time_thread(int core, Treatment& treatment, F run) {
  std::exception_ptr failure;
  std::thread([&] {
    prctl(PR_SET_TIMERSLACK, 1UL);  // without SCHED_FIFO the kernel would add 50 us to each sleep
    const RealTime granted = request_real_time(core);
    treatment.scheduling = granted.describe();
    try {
      run(granted);
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
}

// Loads the models that open_device() needs, before the treatment's thread exists.
void load_models(const Config& config, const DeviceAddress& place, ModelStore& models) {
  models.reduced();
  if (place.eye()) models.model_full();
  if (place.here() && config.plant.model == PlantModel::kFull) models.plant_full();
}

}  // namespace

void require_real_time(const Config& config) {
  const int core = config.safety.core;
  bool may_run = true;
  std::thread([&] { may_run = core == kAnyCore || pin_to_core(core); }).join();
  if (!may_run) {
    throw Error(ErrorParts{.key = "safety.core",
                           .problem = "the loop may not run on that core",
                           .found = fmt::format("{}", core),
                           .accepted = allowed_cores() + ", or -1"});
  }
  if (config.safety.real_time != RealTimeMode::kEnforce) return;
  RealTime granted;
  std::thread([&granted] { granted = request_real_time(); }).join();
  if (granted.fifo_priority && granted.locked_memory) return;
  throw Error(ErrorParts{.where = "real time",
                         .key = "safety.real_time",
                         .problem = "this machine does not grant what \"enforce\" needs",
                         .found = granted.describe(),
                         .accepted = "SCHED_FIFO and locked memory (limits rtprio and memlock), or "
                                     "\"observe\" with a simulated eye"});
}

Treatment run_treatment(const Config& config, ModelStore& models, const DeviceAddress& place,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
                        const std::filesystem::path& log_folder, LogOptions log_options,
                        const TreatmentMonitor& monitor) {
  if (place.here() && config.photoacoustics.sampling == Sampling::kPulses) {
    throw Error(ErrorParts{.key = "photoacoustics.sampling",
                           .problem = "the eye in this process has no pulses",
                           .found = "pulses",
                           .accepted = "instant, or treat --device eye"});
  }
  load_models(config, place, models);
  std::unique_ptr<LogWriter> log;
  if (!log_folder.empty()) {
    log = start_log(config, models, log_folder, describe(place), std::move(log_options));
  }
  const LoopContext context{{.stop = &stop, .progress = &progress, .log = log.get()}, monitor};
  Treatment treatment = with_room(config);
  const auto run = [&](const RealTime& granted) {
    open_device(config, place, models, granted,
                [&](auto& open) { treat(config, open, context, treatment); });
  };
  if (place.kind == DeviceAddress::Kind::kVirtual) {
    run({});
  } else {
    on_a_real_time_thread(config.safety.core, treatment, run);
  }
  if (log) treatment.log = finish_log(*log);
  return treatment;
}

Treatment treat_into(const std::filesystem::path& folder, const Config& controlled,
                     const DeviceAddress& place, ModelStore& models, const std::atomic<bool>& stop,
                     std::atomic<std::size_t>& progress, const TreatmentMonitor& monitor) {
  DeviceAddress device = place;
  std::optional<EyeProcess> eye;
  if (place.own_process) {
    std::vector<std::string> arguments;
    for (const std::string& fault : place.faults) {
      arguments.insert(arguments.end(), {"--fault", fault});
    }
    device.path = eye.emplace(folder / "config.toml", arguments).socket();
  }
  const bool is_virtual = place.kind == DeviceAddress::Kind::kVirtual;
  return run_treatment(controlled, models, device, stop, progress,
                       is_virtual ? std::filesystem::path() : folder / "log", {}, monitor);
}

Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const PlantMismatch& options) {
  Treatment treatment = with_room(config);
  with_simulated_eye<VirtualPace>(config, model, eye, options, {},
                                  [&](auto& open) { treat(config, open, {}, treatment); });
  return treatment;
}

Treatment simulate_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                        const UserParts& own, const std::atomic<bool>& stop,
                        std::atomic<std::size_t>& progress) {
  const LoopContext context{{.stop = &stop, .progress = &progress}};
  Treatment treatment = with_room(config);
  with_simulated_eye<VirtualPace>(config, model, eye, {}, own.plant, [&](auto& open) {
    if (!own.controller) return treat(config, open, context, treatment);
    ControllerRef controller = *own.controller;
    treat_with(config, controller, open, context, treatment);
  });
  return treatment;
}

bool is_device_fault(SafetyReason reason) noexcept {
  switch (reason) {
    case SafetyReason::kSampleMissing:
    case SafetyReason::kSampleStale:
    case SafetyReason::kSampleStuck:
    case SafetyReason::kSampleSaturated:
    case SafetyReason::kSampleRejected:
    case SafetyReason::kMeasurementNoise:
    case SafetyReason::kPowerReadback:
    case SafetyReason::kPowerStuckOn:
    case SafetyReason::kWriteFailed:
    case SafetyReason::kDeviceGone:
    case SafetyReason::kInterlock:
    case SafetyReason::kShutter:
      return true;
    default:
      return false;
  }
}

}  // namespace photocoag
