#include "photocoag/run/open_device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "photocoag/rt/eye_link.hpp"
#include "photocoag/run/calibration_file.hpp"
#include "photocoag/run/pulse_model.hpp"

namespace photocoag {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Tissue that stays cold.
struct ColdPlant {
  void step(double) noexcept {}
  Outputs outputs() const noexcept { return {}; }
};

// With "observe" there may be no real-time scheduling, so wait longer for the eye.
double patience_of(const Config& config) {
  return config.safety.real_time == RealTimeMode::kEnforce
             ? 1.5
             : std::max(1.5, kEyeStall / config.control.period);
}

void require_fitting(const EyeDevice& device, const Config& config, int pulses) {
  if (device.pulses_per_period() != pulses) {
    throw DeviceError(ErrorParts{.where = "eye",
                                 .key = "photoacoustics.pulse_period_ms",
                                 .problem = "the eye pulses at another rate"});
  }
  if (device.welcome().power_max < config.control.power_max * (1.0 - 1e-9)) {
    throw DeviceError(ErrorParts{.where = "eye",
                                 .key = "control.power_max_W",
                                 .problem = "the eye's laser accepts less",
                                 .found = fmt::format("{:g} W", config.control.power_max),
                                 .accepted = fmt::format("at most {:g} W, of its own configuration",
                                                         device.welcome().power_max)});
  }
}

}  // namespace

// On separate tissue, so that the treatment's own stays cold.
SelfTestReport self_test_eye(const Config& config, bool log_has_room) {
  SimulatedEye device(ColdPlant(), config.plant.noise, config.run.seed,
                      {.delay = config.control.delay});
  constexpr std::uint64_t kNever = std::uint64_t{1} << 40;  // noise used by no treatment
  return self_test(device, config.control, log_has_room, kNever);
}

OpenEye::OpenEye(const Config& config, DeviceAddress place, ModelStore& models,
                 const RealTime& granted)
    : config_(config), place_(std::move(place)), pulses_(pulses_per_period(config)) {
  const ReducedModel& model = models.reduced();
  model_ =
      pulse_averaged_model(model, pulses_, prompt_feedthrough(models.model_full(), model, pulses_));
  const GrueneisenCurve curve(load_curve(config.photoacoustics.calibration));
  of_the_device([&] {
    device_.emplace(EyeLinkSettings{.socket = place_.path,
                                    .transport = place_.kind == DeviceAddress::Kind::kEye
                                                     ? EyeTransport::kSharedMemory
                                                     : EyeTransport::kSocket,
                                    .period = config.control.period,
                                    .delay = config.control.delay,
                                    .patience = patience_of(config)});
  });
  require_fitting(*device_, config, pulses_);
  last_resort_.emplace(*device_);
  of_the_device([&] {
    pace_ = choose_pace(config, device_->welcome(), granted.fifo_priority, granted.cores);
    if (pace_.lockstep) device_->follow_in_lockstep();
    device_->prepare(curve, {.ambient_celsius = config.tissue.ambient_celsius},
                     config.photoacoustics.baseline_pulses);
    if (pace_.lockstep) return;
    pace_ = pace_after_baseline(config, device_->welcome(), device_->late_in_baseline());
    if (pace_.lockstep) device_->follow_in_lockstep();
  });
}

SafetyLimits OpenEye::limits() const { return device_limits(config_); }

ObserverModel OpenEye::observer() const { return device_observer(config_, pulses_); }

SelfTestReport OpenEye::self_test(bool log_has_room) {
  device_->begin(0);
  return photocoag::self_test(*device_, config_.control, log_has_room);
}

void OpenEye::finish(Treatment& treatment) {
  treatment.full_order_states = device_->welcome().states;
  const std::vector<PeriodTruth>& truth = device_->finish_truth();
  DeviceReport report{.name = describe(place_),
                      .pulses_per_period = pulses_,
                      .late_pulses = static_cast<std::int64_t>(device_->late_pulses()),
                      .pulse_peak_max = 0.0,
                      .status = {},
                      .pacing = pace_.describe(),
                      .lockstep = pace_.lockstep};
  try {
    report.status = command_eye(place_.path, "status");
  } catch (const Error&) {
    report.status = "gone";
  }
  for (std::size_t k = 0; k < treatment.records.size(); ++k) {
    const bool known = k < truth.size();
    treatment.records[k].truth = known ? truth[k].outputs : Outputs{.volume = kNaN, .peak = kNaN};
    if (known) report.pulse_peak_max = std::max(report.pulse_peak_max, truth[k].peak_pulse);
  }
  treatment.device = report;
}

}  // namespace photocoag
