#include "photocoag/config/fields.hpp"

#include <iterator>
#include <limits>
#include <utility>

namespace photocoag {
namespace {

// In the order of the enumerators.
std::vector<std::string_view> discretization_words() {
  return {to_string(Discretization::kZeroOrderHold), to_string(Discretization::kImplicitEuler),
          to_string(Discretization::kTrBdf2)};
}

// A build without OSQP knows its words but does not support them.
std::vector<Field> control_fields(ControlSettings& settings) {
  std::vector<Field> list = fields_of(settings);
#if !PHOTOCOAG_HAS_OSQP
  for (Field& field : list) {
    if (field.key != "control.solver") continue;
    std::get<WordField>(field.value).unavailable = {"osqp", "osqp-condensed"};
  }
#endif
  return list;
}

std::vector<Field> safety_fields(SafetySettings& s) {
  using namespace units;
  FieldTable table("safety");
  table.word("supervisor", s.supervised, {"off", "on"},
             "on: checks samples and commands, lowers or refuses powers, stops; off: the paper");
  table.number("power_rise_max_W", s.power_rise_max, kWatt, {0, 1, true},
               "largest rise of the power from one period to the next");
  table.number("energy_max_mJ", s.energy_max, {"mJ", -3}, {0, 60000, true},
               "emitted energy at which a treatment ends");
  table.number("exposure_max_ms", s.exposure_max, kMilliseconds, {0, 60000, true},
               "time with light after which a treatment ends");
  table.number("thermal_dose_max", s.thermal_dose_max, kOne, {0, 1e6},
               "Arrhenius integral (schlott_2012) at which the treatment ends; 0: no limit");
  table.number("power_accuracy_relative", s.power_accuracy, kOne, {0, 0.5},
               "uncertainty of the true power by an external power meter; a margin of the gate");
  table.number("sample_gain_accuracy_relative", s.sample_gain_accuracy, kOne, {0, 0.5},
               "the same for the samples' gain, by an external temperature standard");
  table.word("real_time", s.real_time, {"observe", "enforce"},
             "enforce: refuse without SCHED_FIFO and locked memory, strict about overruns and held "
             "powers; observe: a simulated eye only");
  table.integer("core", s.core, -1, 1023,
                "core to which the loop of `treat` is pinned, best an isolated one; -1: none");
  return table.take();
}

std::vector<Field> model_fields(ModelSettings& s) {
  FieldTable table("model");
  table.path("file", s.file,
             "a reduced model made by `photocoag reduce`; empty: reduce now (cached)");
  table.word("discretization", s.discretization, discretization_words(),
             "exact for constant power, the paper's scheme, or one of second order");
  std::vector<Field> list = table.take();
  std::vector<Field> reduction = fields_of(s.reduction);
  // The order comes second.
  list.insert(list.begin() + 1, std::move(reduction.front()));
  std::move(reduction.begin() + 1, reduction.end(), std::back_inserter(list));
  return list;
}

std::vector<Field> uncertainty_fields(UncertaintySettings& s) {
  using namespace units;
  FieldTable table("uncertainty");
  table.number("spot_radius_relative", s.spot_radius, kOne, {0, 0.5},
               "relative, either way: 0.1 is 10 %");
  table.number("thickness_relative", s.thickness, kOne, {0, 0.5},
               "the same, for each layer independently");
  table.number("absorption_relative", s.absorption, kOne, {0, 0.5},
               "the same, for the layers that alpha does not scale (the choroid)");
  return table.take();
}

std::vector<Field> plant_fields(PlantSettings& s) {
  using namespace units;
  FieldTable table("plant");
  table.word("model", s.model, {"full", "reduced"},
             "the full-order model of [grid], or a reduced one");
  table.number("absorption_factor", s.absorption_factor, kOne, {0.05, 5}, "the true alpha");
  table.number("choroid_factor", s.choroid_factor, kOne, {0.05, 20},
               "the true beta; 1 unless a layer has scaled_by = \"beta\"");
  table.number("noise_K", s.noise, kKelvin, {0, 20}, "standard deviation per control sample");
  table.number(
      "sample_averaging_periods", s.bench.timing.averaging, kPeriods, {0, 1},
      "the sample is the mean of the volume temperature over this part of a period; 0: its value");
  table.number("sample_lag_periods", s.bench.timing.sample_lag, kPeriods, {0, 1},
               "the sample is taken this long before the period's end");
  table.number("power_lag_periods", s.bench.timing.power_lag, kPeriods, {0, 1},
               "a power takes effect this much later, and lasts as much longer");
  table.word("power_readback", s.bench.readback, {"emitted", "none"},
             "mean of the emitted power over the period, or none: the command is taken for it");
  table.number("power_gain", s.bench.power_gain, kOne, {0.5, 2}, "emitted / commanded power");
  table.number("sample_gain", s.bench.sample_gain, kOne, {0.5, 2},
               "measured / true volume temperature, without noise");
  table.number("sample_offset_K", s.bench.sample_offset, kKelvin, {-50, 50},
               "constant error of every sample: a baseline that was wrong");
  table.number("absorption_drift_per_s", s.bench.absorption_drift, {"1/s"}, {-10, 10},
               "of the true alpha, relative to absorption_factor, linear in time; from 0.05 to 5");
  table.word("zero_power_sample", s.zero_power_sample, {"measured", "missing"},
             "missing: a single laser measures only while it emits; then see control.power_min_W");
  table.word("discretization", s.discretization, discretization_words(),
             "exact for constant power, the paper's scheme, or one of second order");
  return table.take();
}

std::vector<Field> photoacoustic_fields(PhotoacousticSettings& s) {
  using namespace units;
  FieldTable table("photoacoustics");
  table.word(
      "sampling", s.sampling, {"instant", "pulses"},
      "a control sample is the value at the end of its period, or the mean over its pulses, each "
      "just before its own heat; treat --device eye sets \"pulses\"");
  table.path("calibration", s.calibration,
             "the Grueneisen curve made by `photocoag calibrate`; empty: water-like, not verified");
  table.number("pulse_period_ms", s.pulse_period, kMilliseconds, {0.02, 10},
               "between laser pulses; a whole fraction of control.period_ms");
  table.integer("baseline_pulses", s.baseline_pulses, 16, 100000,
                "on cold tissue before a treatment");
  table.path("eye_calibration", s.eye_calibration,
             "the simulated eye's true curve; empty: that of calibration");
  table.word(
      "eye_noise", s.eye_noise, {"temperature", "voltage"},
      "noise of the simulated eye: constant in K, or in volts (plant.noise_K at 2.6 uJ, cold)");
  table.word("eye_pacing", s.eye_pacing, {"auto", "wall", "lockstep"},
             "of the simulated eye's process: by the clock, in lockstep with the controller (real "
             "time is then not measured), or auto: the clock where both keep it");
  return table.take();
}

std::vector<Field> run_fields(RunSettings& s) {
  using namespace units;
  FieldTable table("run");
  table.number("duration_ms", s.duration, kMilliseconds, {0, 60000, true},
               "at least one control period, at most 1000000 of them");
  table.word("goal", s.goal, {"duration", "hold", "dose"},
             "what ends the treatment: duration_ms; hold_ms at the reference; the dose. "
             "duration_ms is the longest it may last");
  table.number("hold_ms", s.hold, kMilliseconds, {0, 60000, true},
               "with goal \"hold\": time with an estimated peak of at least 95 % of "
               "control.peak_reference_K");
  table.number("dose", s.dose, kOne, {0, 1e6, true},
               "with goal \"dose\": Arrhenius integral (schlott_2012) at the estimated peak; 1 "
               "stands for damage");
  table.integer("seed", s.seed, 0, std::numeric_limits<std::int64_t>::max(),
                "of the simulated measurement noise");
  return table.take();
}

}  // namespace

const std::vector<Section>& sections() {
  static const std::vector<Section> list = {
      {"control", "the paper's optimal control problem"},
      {"estimator", "alpha and temperatures from the measured volume temperature"},
      {"safety", "the supervisor between controller and laser; docs/safety.md"},
      {"model", "what the controller believes: a reduced model"},
      {"grid", "the full-order model, of the eye and behind the reduced model"},
      {"tissue", "what the model is built from; temperatures are rises over ambient"},
      {"uncertainty",
       "how far the eye may differ from [tissue]; reference and limit are backed off"},
      {"plant", "the simulated eye"},
      {"plant.tissue", "the true eye where it differs from [tissue]; shown complete"},
      {"photoacoustics", "how a device measures by its pulses; docs/photoacoustics.md"},
      {"run", "one treatment"},
  };
  return list;
}

std::vector<Field> fields(Config& config) {
  std::vector<Field> list;
  const auto add = [&list](std::vector<Field> section) {
    std::move(section.begin(), section.end(), std::back_inserter(list));
  };
  add(control_fields(config.control));
  add(fields_of(config.estimator));
  add(safety_fields(config.safety));
  add(model_fields(config.model));
  add(fields_of(config.grid));
  add(fields_of(config.tissue, "tissue"));
  add(uncertainty_fields(config.uncertainty));
  add(plant_fields(config.plant));
  add(fields_of(config.plant.tissue, "plant.tissue"));
  add(photoacoustic_fields(config.photoacoustics));
  add(run_fields(config.run));
  return list;
}

}  // namespace photocoag
