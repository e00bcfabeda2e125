#include "photocoag/run/device_treatment.hpp"

#include <fmt/format.h>
#include <sys/prctl.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <optional>
#include <thread>
#include <type_traits>
#include <vector>

#include "photocoag/rom/intersample.hpp"
#include "photocoag/rt/continued_device.hpp"
#include "photocoag/rt/driver_device.hpp"
#include "photocoag/rt/eye_device.hpp"
#include "photocoag/rt/eye_link.hpp"
#include "photocoag/rt/last_resort.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/calibration_file.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/device_self_test.hpp"
#include "photocoag/run/eye_pacing.hpp"
#include "photocoag/run/pulse_model.hpp"
#include "photocoag/run/supervised_loop.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/treatment_log.hpp"

namespace photocoag {
namespace {

using Mpc = ModelPredictiveController<DenseSolver>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// A device that cannot be had is a device's fault, not bad input.
template <typename F>
void of_the_device(F&& open) {
  try {
    open();
  } catch (const Error& error) {
    if (!error.parts().key.empty()) throw;  // the configuration's
    throw DeviceError(error);
  }
}

/// What a treatment on a device gets from its caller.
struct Attempt {
  LoopContext context;
  bool priority;  // SCHED_FIFO was granted
  int cores;      // that the process may use
};

template <Controlling C, Device D>
void treat_with(const Config& config, C& controller, D& device, const ObserverModel& observer,
                const LoopContext& context, Treatment& treatment) {
  DeviceCursor cursor;
  constexpr bool kEye = std::is_same_v<D, EyeDevice>;
  bool timed = true;
  if constexpr (kEye) timed = !device.in_lockstep();
  if constexpr (kEye) device.begin(0);
  const SelfTestReport report = self_test(device, config.control, context.log_is_good(), cursor);
  const auto loop = [&](auto& supervisor) {
    ContinuedDevice continued(device, kEye ? 0 : cursor.sequence, cursor.token);
    if constexpr (kEye) device.begin(config.cycles());
    close_loop(config, controller, continued, supervisor, timed, context, treatment);
  };
  if (!config.safety.supervised) {
    Unsupervised none;
    return loop(none);
  }
  const SafetyLimits limits = device_limits(config);
  context.onlooker.tell(report, limits);
  Supervisor supervisor = begun_supervisor<DeviceError>(limits, observer, report);
  loop(supervisor);
}

// Observe takes what scheduling it gets, and waits for an eye that did not get any; enforce does
// not.
double patience_of(const Config& config) {
  return config.safety.real_time == RealTimeMode::kEnforce
             ? 1.5
             : std::max(1.5, kEyeStall / config.control.period);
}

std::string device_name(const DeviceAddress& address) {
  return address.over_socket ? "eye, socket" : "eye, shared memory";
}

void treat_eye(const Config& config, const DeviceAddress& address, const ReducedModel& model,
               const PromptFeedthrough& feed, const Attempt& attempt, Treatment& treatment) {
  const int pulses = pulses_per_period(config);
  const GrueneisenCurve curve(load_curve(config.photoacoustics.calibration));
  std::optional<EyeDevice> place;
  of_the_device([&] {
    place.emplace(EyeLinkSettings{
        .socket = address.path,
        .transport = address.over_socket ? EyeTransport::kSocket : EyeTransport::kSharedMemory,
        .period = config.control.period,
        .delay = config.control.delay,
        .patience = patience_of(config)});
  });
  EyeDevice& device = *place;
  if (device.pulses_per_period() != pulses) {
    throw DeviceError(ErrorParts{.where = "eye",
                                 .key = "photoacoustics.pulse_period_ms",
                                 .problem = "the eye pulses at another rate"});
  }
  if (device.welcome().power_max < config.control.power_max * (1.0 - 1e-9)) {
    throw DeviceError(ErrorParts{.where = "eye",
                                 .key = "control.power_max_W",
                                 .problem = "the eye's laser takes less",
                                 .found = fmt::format("{:g} W", config.control.power_max),
                                 .accepted = fmt::format("at most {:g} W, of its own configuration",
                                                         device.welcome().power_max)});
  }
  set_last_resort([](void* d) noexcept { static_cast<EyeDevice*>(d)->safe_off(); }, &device);
  EyePace pace;
  of_the_device([&] {
    pace = choose_pace(config, device.welcome(), attempt.priority, attempt.cores);
    if (pace.lockstep) device.follow_in_lockstep();
    device.prepare(curve, {.ambient_celsius = config.tissue.ambient_celsius},
                   config.photoacoustics.baseline_pulses);
    if (pace.lockstep) return;
    pace = pace_after_baseline(config, device.welcome(), device.late_in_baseline());
    if (pace.lockstep) device.follow_in_lockstep();
  });
  treatment.full_order_states = device.welcome().states;
  const ObserverModel observer = device_observer(config, pulses);
  BasicController<Mpc> controller(pulse_averaged_model(model, pulses, feed), config.control,
                                  config.estimator);
  treat_with(config, controller, device, observer, attempt.context, treatment);
  treatment.prior_check = prior_check_of(controller.filter());
  const std::vector<PeriodTruth>& truth = device.finish_truth();
  DeviceReport report{.name = device_name(address),
                      .pulses_per_period = pulses,
                      .late_pulses = static_cast<std::int64_t>(device.late_pulses()),
                      .pulse_peak_max = 0.0,
                      .status = {},
                      .pacing = pace.describe(),
                      .lockstep = pace.lockstep};
  try {
    report.status = tell_eye(address.path, "status");
  } catch (const Error&) {
    report.status = "gone";
  }
  for (std::size_t k = 0; k < treatment.records.size(); ++k) {
    const bool known = k < truth.size();
    treatment.records[k].truth = known ? truth[k].outputs : Outputs{.volume = kNaN, .peak = kNaN};
    if (known) report.pulse_peak_max = std::max(report.pulse_peak_max, truth[k].peak_pulse);
  }
  treatment.device = report;
  set_last_resort([](void*) noexcept {}, nullptr);
}

void treat_driver(const Config& config, const DeviceAddress& address, const ReducedModel& model,
                  const Attempt& attempt, Treatment& treatment) {
  const bool strict = config.safety.supervised && config.safety.real_time == RealTimeMode::kEnforce;
  std::optional<DriverDevice> place;
  of_the_device(
      [&] { place.emplace(address.path, address.settings, config.control.period, strict); });
  DriverDevice& device = *place;
  set_last_resort([](void* d) noexcept { static_cast<DriverDevice*>(d)->safe_off(); }, &device);
  treatment.device = DeviceReport{
      .name = "driver, " + device.name(), .pulse_peak_max = kNaN, .status = {}, .pacing = {}};
  BasicController<Mpc> controller(told_of(model, config.estimator.timing), config.control,
                                  config.estimator);
  treat_with(config, controller, device, device_observer(config), attempt.context, treatment);
  treatment.prior_check = prior_check_of(controller.filter());
  for (CycleRecord& record : treatment.records) record.truth = {.volume = kNaN, .peak = kNaN};
  set_last_resort([](void*) noexcept {}, nullptr);
}

}  // namespace

Treatment run_device_treatment(const Config& config, const DeviceAddress& device,
                               ModelStore& models, const std::atomic<bool>& stop,
                               std::atomic<std::size_t>& progress,
                               const std::filesystem::path& log_folder, const Onlooker& onlooker) {
  const ReducedModel& model = models.reduced();
  PromptFeedthrough feed;
  if (device.eye()) {
    feed = prompt_feedthrough(models.model_full(), model, pulses_per_period(config));
  }
  const auto log = start_log(config, models, log_folder,
                             device.eye() ? device_name(device) : "driver, " + device.path);
  Treatment treatment;
  treatment.records.resize(config.cycles());
  treatment.full_order_states = model.full_order_states;
  std::exception_ptr failure;
  const int cores = count_allowed_cores();
  std::thread loop([&] {
    prctl(PR_SET_TIMERSLACK, 1UL);  // without SCHED_FIFO the kernel would add 50 us to each sleep
    const RealTime granted = request_real_time(config.safety.core);
    treatment.scheduling = granted.describe();
    const Attempt attempt{{stop, progress, log.get(), onlooker}, granted.fifo_priority, cores};
    try {
      if (device.eye()) {
        treat_eye(config, device, model, feed, attempt, treatment);
      } else {
        treat_driver(config, device, model, attempt, treatment);
      }
    } catch (...) {
      failure = std::current_exception();
    }
  });
  loop.join();
  if (failure) std::rethrow_exception(failure);
  treatment.log = finish_log(*log);
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
