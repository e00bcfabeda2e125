#include "photocoag/run/device_treatment.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <span>
#include <thread>

#include "photocoag/rt/continued_device.hpp"
#include "photocoag/rt/driver_device.hpp"
#include "photocoag/rt/eye_device.hpp"
#include "photocoag/rt/last_resort.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/calibration_file.hpp"
#include "photocoag/run/observer.hpp"
#include "photocoag/run/pulse_model.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/treatment_log.hpp"

namespace photocoag {
namespace {

using Mpc = ModelPredictiveController<DenseSolver>;
constexpr double kStall = 0.5;  // s, that a simulated eye and its controller may stand still
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

/// Where the self-test has left a device.
struct Served {
  std::uint64_t cycles = 0;
  std::uint64_t token = 0;
};

// Samples of the cold eye at 0 W, then a trip of the watchdog with 1 mW, and time to cool down.
template <Device D>
SelfTestReport self_test(D& device, int delay, bool log_has_room, Served& served) {
  constexpr std::size_t kSamples = 64;
  constexpr std::uint64_t kMostCycles = 512;
  constexpr double kLittle = 1e-3;  // W
  std::vector<double> baseline;
  double power_at_zero = 0.0;
  const auto wait = [&] {
    const DeviceSample sample = device.wait_sample(served.cycles++);
    if (sample.status == DeviceStatus::kGone) {
      throw DeviceError(ErrorParts{.where = "self-test", .problem = "the device has vanished"});
    }
    return sample;
  };
  const auto write = [&](double power) { device.write_power(power, ++served.token); };
  write(0.0);
  while (baseline.size() < kSamples && served.cycles < kMostCycles) {
    const DeviceSample sample = wait();
    write(0.0);
    if (sample.periods_behind > 0) continue;
    if (std::isfinite(sample.volume_temperature)) baseline.push_back(sample.volume_temperature);
    power_at_zero = std::max(power_at_zero, device.readback().power);
  }
  SelfTestReport report = self_test_of(baseline);
  report.power_at_zero = power_at_zero;
  write(kLittle);
  double seen = 0.0;
  double last = kNaN;
  for (int k = 0; k < 4 + delay; ++k) {
    wait();
    last = device.readback().power;
    seen = std::max(seen, last);
  }
  report.watchdog_tripped = last == 0.0 && seen > 0.0;
  for (int k = 0; k < 50; ++k) {
    write(0.0);
    wait();
  }
  write(0.0);
  report.model_matches = true;  // ModelStore has refused any other
  report.solver_exact = solver_is_exact();
  report.log_has_room = log_has_room;
  return report;
}

/// What every treatment gets from its caller.
struct Surroundings {
  const std::atomic<bool>& stop;
  std::atomic<std::size_t>& progress;
  LogWriter& log;
};

template <Controlling C, Device D>
void treat_with(const Config& config, C& controller, D& device, WitnessModel witness,
                const Surroundings& around, Treatment& treatment) {
  const double period = config.control.period;
  Served served;
  constexpr bool kEye = std::is_same_v<D, EyeDevice>;
  if constexpr (kEye) device.begin(0);
  const SelfTestReport report =
      self_test(device, config.control.delay, around.log.healthy(), served);
  const auto loop = [&](auto& supervisor) {
    ContinuedDevice continued(device, kEye ? 0 : served.cycles, served.token, config.cycles(),
                              around.stop);
    TreatmentObserver observer(period, true, &around.log, GoalWatch(config));
    if constexpr (kEye) device.begin(config.cycles());
    const auto begin = std::chrono::steady_clock::now();
    const PageFaults before = page_faults();
    treatment.outcome = run_loop(controller, continued, supervisor, period,
                                 std::span(treatment.records), around.progress, observer);
    treatment.page_faults = page_faults() - before;
    treatment.histograms = observer.histograms();
    treatment.goal = observer.goal();
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    treatment.wall_seconds = wall.count();
    treatment.timing = continued.timing();
    treatment.records.resize(treatment.outcome.cycles);
  };
  if (!config.safety.supervised) {
    Unsupervised none;
    return loop(none);
  }
  Supervisor supervisor(device_limits(config), witness);
  supervisor.power_on();
  if (!supervisor.finish_self_test(report) || !supervisor.ready() || !supervisor.begin(true)) {
    throw DeviceError(not_ready(report, config.plant.noise));
  }
  loop(supervisor);
}

WitnessModel witness_of(const Config& config, const ReducedModel& model) {
  return witness_model(model, config.estimator);
}

// Observe takes what scheduling it gets, and waits for an eye that did not get any; enforce does
// not.
double patience_of(const Config& config) {
  return config.safety.real_time == RealTimeMode::kEnforce
             ? 1.5
             : std::max(1.5, kStall / config.control.period);
}

void treat_eye(const Config& config, const DeviceAddress& address, const ReducedModel& model,
               const PulseFeed& feed, const Surroundings& around, Treatment& treatment) {
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
  set_last_resort([](void* d) noexcept { static_cast<EyeDevice*>(d)->safe_off(); }, &device);
  of_the_device([&] {
    device.prepare(curve, {.ambient_celsius = config.tissue.ambient_celsius},
                   config.photoacoustics.baseline_pulses);
  });
  treatment.full_order_states = device.full_order_states();
  WitnessModel witness = witness_of(config, model);
  see_pulses(witness, pulses, feed);
  BasicController<Mpc> controller(seen_by_pulses(model, pulses, feed), config.control,
                                  config.estimator);
  treat_with(config, controller, device, witness, around, treatment);
  const std::vector<PeriodTruth>& truth = device.finish_truth();
  DeviceReport report{.name = address.over_socket ? "eye, socket" : "eye, shared memory",
                      .pulses_per_period = pulses,
                      .late_pulses = static_cast<std::int64_t>(device.late_pulses()),
                      .pulse_peak_max = 0.0,
                      .status = {}};
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
                  const Surroundings& around, Treatment& treatment) {
  const bool strict = config.safety.supervised && config.safety.real_time == RealTimeMode::kEnforce;
  std::optional<DriverDevice> place;
  of_the_device(
      [&] { place.emplace(address.path, address.settings, config.control.period, strict); });
  DriverDevice& device = *place;
  set_last_resort([](void* d) noexcept { static_cast<DriverDevice*>(d)->safe_off(); }, &device);
  treatment.device =
      DeviceReport{.name = "driver, " + device.name(), .pulse_peak_max = kNaN, .status = {}};
  BasicController<Mpc> controller(model, config.control, config.estimator);
  treat_with(config, controller, device, witness_of(config, model), around, treatment);
  for (CycleRecord& record : treatment.records) record.truth = {.volume = kNaN, .peak = kNaN};
  set_last_resort([](void*) noexcept {}, nullptr);
}

}  // namespace

DeviceAddress parse_device(const std::string& text) {
  DeviceAddress address;
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool bad = colon != std::string::npos && rest.empty();
  if (kind == "driver" && !rest.empty()) {
    address.kind = DeviceAddress::Kind::kDriver;
    const std::size_t comma = rest.find(',');
    address.path = rest.substr(0, comma);
    if (comma != std::string::npos) address.settings = rest.substr(comma + 1);
    return address;
  }
  if ((kind != "eye" && kind != "eye+socket") || bad) {
    throw Error(ErrorParts{
        .where = "--device",
        .found = text,
        .accepted = "eye, eye:SOCKET, eye+socket[:SOCKET] or driver:LIBRARY[,SETTINGS]"});
  }
  address.over_socket = kind == "eye+socket";
  address.own_process = rest.empty();
  address.path = rest;
  return address;
}

SafetyLimits device_limits(const Config& config) {
  SafetyLimits limits = safety_limits(config);
  // A device holds its power when a write is missed, whatever scheduling there is.
  limits.hold_excess = std::min(limits.hold_excess, 1.0);
  const bool eye = config.photoacoustics.sampling == Sampling::kPulses;
  if (eye && config.safety.real_time == RealTimeMode::kObserve) {
    limits.overruns_in_a_row_max = std::max(
        limits.overruns_in_a_row_max, static_cast<std::int64_t>(kStall / config.control.period));
  }
  return limits;
}

int pulses_per_period(const Config& config) {
  const double ratio = config.control.period / config.photoacoustics.pulse_period;
  const double whole = std::round(ratio);
  if (whole < 1.0 || std::abs(ratio - whole) > 1e-6) {
    throw Error(ErrorParts{.key = "photoacoustics.pulse_period_ms",
                           .found = fmt::format("{}", config.photoacoustics.pulse_period * 1e3),
                           .accepted = fmt::format("a whole fraction of control.period_ms = {}",
                                                   config.control.period * 1e3)});
  }
  return static_cast<int>(whole);
}

void require_plausible(const GrueneisenCurve& curve, const Config& config) {
  // Relative rise per K. Water-like 4.7 % at 20 deg C, 2.6 % at 37: a curve in other units (mK, or
  // kelvin instead of deg C) is far outside.
  constexpr double kLeast = 0.003;
  constexpr double kMost = 0.15;
  const std::string& file = config.photoacoustics.calibration;
  const double cold = config.tissue.ambient_celsius;
  const double hot = cold + config.control.peak_max;
  if (curve.low() > cold || curve.high() < hot) {
    throw Error(ErrorParts{.where = file,
                           .key = "curve.valid_C",
                           .problem = "the treatment leaves the calibrated range",
                           .found = fmt::format("[{:g}, {:g}]", curve.low(), curve.high()),
                           .accepted = fmt::format("from tissue.ambient_C to that plus "
                                                   "control.peak_max_K: {:g} to {:g} deg C",
                                                   cold, hot)});
  }
  const double rise = curve.slope(cold) / curve.value(cold);
  if (!(rise >= kLeast && rise <= kMost)) {
    throw Error(
        ErrorParts{.where = file,
                   .key = "curve",
                   .problem = "this is no tissue's curve",
                   .found = fmt::format("{:.3g} % per K at {:g} deg C", 100 * rise, cold),
                   .accepted = fmt::format("{:g} to {:g} % per K", 100 * kLeast, 100 * kMost)});
  }
}

Config for_device(Config config, const DeviceAddress& device) {
  if (config.control.solver != SolverKind::kDense) {
    throw Error(ErrorParts{.key = "control.solver",
                           .problem = "a device is driven by the solver that is real-time safe",
                           .accepted = "\"dense\""});
  }
  if (!device.eye()) return config;
  pulses_per_period(config);
  require_plausible(GrueneisenCurve(load_curve(config.photoacoustics.calibration)), config);
  config.tissue.volume_temperature = VolumeTemperature::kNormalized;
  config.plant.tissue.volume_temperature = VolumeTemperature::kNormalized;
  config.plant.model = PlantModel::kFull;
  config.photoacoustics.sampling = Sampling::kPulses;
  return config;
}

EyeProcess::EyeProcess(const std::filesystem::path& config_file,
                       const std::vector<std::string>& arguments, bool once)
    : once_(once) {
  std::string name = (std::filesystem::temp_directory_path() / "photocoag-eye-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw DeviceError(ErrorParts{.problem = "no folder"});
  folder_ = name;
  socket_ = folder_ + "/eye";
  std::vector<std::string> words = {"photocoag",          "eye",      "--config",
                                    config_file.string(), "--socket", socket_};
  if (once) words.emplace_back("--once");
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t id = -1;
  if (posix_spawn(&id, "/proc/self/exe", nullptr, nullptr, argv.data(), environ) != 0) {
    throw DeviceError(ErrorParts{.where = "eye", .problem = "its process cannot be started"});
  }
  id_ = id;
  constexpr int kPatience = 3000;  // times 10 ms
  for (int i = 0; i < kPatience; ++i) {
    if (std::filesystem::exists(socket_)) return;
    int status = 0;
    if (waitpid(id_, &status, WNOHANG) == id_) {
      id_ = -1;
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw DeviceError(ErrorParts{.where = "eye", .problem = "its process has not come up"});
}

EyeProcess::~EyeProcess() {
  constexpr int kPatience = 300;  // times 10 ms
  if (!once_ && id_ > 0) kill(id_, SIGTERM);
  for (int i = 0; i < kPatience && id_ > 0; ++i) {
    int status = 0;
    if (waitpid(id_, &status, WNOHANG) == id_) id_ = -1;
    if (id_ > 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (id_ > 0) {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

Treatment run_device_treatment(const Config& config, const DeviceAddress& device,
                               ModelStore& models, const std::atomic<bool>& stop,
                               std::atomic<std::size_t>& progress,
                               const std::filesystem::path& log_folder) {
  const ReducedModel& model = models.reduced();
  PulseFeed feed;
  if (device.eye())
    feed = feed_of_fresh_heat(models.model_full(), model, pulses_per_period(config));
  const auto log = start_log(config, models, log_folder);
  const Surroundings around{stop, progress, *log};
  Treatment treatment;
  treatment.records.resize(config.cycles());
  treatment.full_order_states = model.full_order_states;
  std::exception_ptr failure;
  std::thread loop([&] {
    prctl(PR_SET_TIMERSLACK, 1UL);  // without SCHED_FIFO the kernel would add 50 us to each sleep
    treatment.scheduling = request_real_time(config.safety.core).describe();
    try {
      if (device.eye()) {
        treat_eye(config, device, model, feed, around, treatment);
      } else {
        treat_driver(config, device, model, around, treatment);
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
