#include "photocoag/config/fields.hpp"

#include <fmt/format.h>

#include <limits>
#include <utility>

namespace photocoag {
namespace {

constexpr Unit kOne{""};
constexpr Unit kMilliseconds{"ms", -3};
constexpr Unit kMicrometres{"um", -6};
constexpr Unit kKelvin{"K"};
constexpr Unit kWatt{"W"};
constexpr Unit kWeight{"K2/W2"};
constexpr Unit kPeriods{"periods"};

Field number(std::string key, double& value, Unit unit, Range range, std::string_view meaning) {
  return {std::move(key), NumberField{&value, unit, range}, meaning};
}

Field optional_number(std::string key, std::optional<double>& value, Unit unit, Range range,
                      std::string_view meaning) {
  return {std::move(key), OptionalNumberField{&value, unit, range}, meaning};
}

Field numbers(std::string key, std::vector<double>& values, Unit unit, Range range,
              std::string_view meaning) {
  return {std::move(key), NumbersField{&values, unit, range}, meaning};
}

template <class T>
Field integer(std::string key, T& value, std::int64_t low, std::int64_t high,
              std::string_view meaning) {
  return {std::move(key),
          IntegerField{[&value] { return static_cast<std::int64_t>(value); },
                       [&value](std::int64_t read) { value = static_cast<T>(read); }, low, high},
          meaning};
}

// `words` in the order of the enumerators.
template <class E>
Field word(std::string key, E& value, std::vector<std::string_view> words, std::string_view meaning,
           std::vector<std::string_view> unavailable = {}) {
  return {std::move(key),
          WordField{std::move(words), [&value] { return static_cast<std::size_t>(value); },
                    [&value](std::size_t index) { value = static_cast<E>(index); },
                    std::move(unavailable)},
          meaning};
}

const std::vector<std::string_view> kWithoutOsqp =
#if PHOTOCOAG_HAS_OSQP
    {};
#else
    {"osqp", "osqp-condensed"};
#endif

Field discretization(std::string key, Discretization& value, std::string_view meaning) {
  return word(std::move(key), value,
              {to_string(Discretization::kZeroOrderHold), to_string(Discretization::kImplicitEuler),
               to_string(Discretization::kTrBdf2)},
              meaning);
}

void add_control(ControlSettings& s, std::vector<Field>& list) {
  const auto key = [](std::string_view name) { return fmt::format("control.{}", name); };
  list.insert(
      list.end(),
      {number(key("period_ms"), s.period, kMilliseconds, {0.05, 100}, "control period T"),
       integer(key("horizon"), s.horizon, 2, 50, "N, periods looked ahead, with N - 1 free inputs"),
       number(key("peak_reference_K"), s.peak_reference, kKelvin, {0, 150, true},
              "peak temperature rise to hold, below peak_max_K"),
       number(key("peak_max_K"), s.peak_max, kKelvin, {0, 150, true},
              "limit of the predicted peak temperature rise"),
       number(key("power_max_W"), s.power_max, kWatt, {0, 1, true},
              "largest laser power; 0.1 W is 100 mW"),
       number(key("power_min_W"), s.power_min, kWatt, {0, 1},
              "smallest laser power, below power_max_W"),
       word(key("state_weight"), s.state_weight, {"constant", "delayed"},
            "R0 = 1, or R0(j) = 0 for j = n+k in {1, 2, 3}, which needs a weight below"),
       number(key("power_weight"), s.power_weight, kWeight, {0, 1e9},
              "R1, on power against its steady value"),
       number(key("power_change_weight"), s.power_change_weight, kWeight, {0, 1e9},
              "R2, on the change of power"),
       numbers(key("reference_times_ms"), s.reference_times, kMilliseconds, {0, 60000},
               "ascending; of reference_K. Both empty: peak_reference_K throughout"),
       numbers(key("reference_K"), s.reference_values, kKelvin, {0, 150, true},
               "references at these times, linear between, constant beyond the last"),
       word(key("robust"), s.robust, {"none", "certified", "chance"},
            "certified: the limit holds for the estimate plus robust_sigma deviations and the "
            "model's proved error; chance: with all but limit_probability, given [[prior]]"),
       number(key("robust_sigma"), s.robust_sigma, kOne, {0, 10}, "standard deviations"),
       number(key("limit_probability"), s.limit_probability, kOne, {1e-6, 0.5},
              "with robust \"chance\": of a treatment to exceed peak_max_K"),
       number(key("identification_ms"), s.identification_duration, kMilliseconds, {0, 60000},
              "the longest gentle start, with robust \"chance\"; 0: none"),
       number(key("identification_power_W"), s.identification_power, kWatt, {0, 1, true},
              "of that start"),
       number(key("identification_sigma_K"), s.identification_sigma, kKelvin, {0, 50},
              "it ends once the peak at the reference is known to this standard deviation; 0: by "
              "time only"),
       integer(key("delay_cycles"), s.delay, 0, 1,
               "periods from a sample to the power computed from it"),
       integer(key("solve_every"), s.solve_every, 1, 49,
               "periods from one solution to the next, below horizon; its plan in between"),
       number(key("first_power_W"), s.first_power, kWatt, {0, 1},
              "of the first period, given instead of solved for: 0.02 in the paper's experiments; "
              "0: solved for"),
       word(key("solver"), s.solver, {"dense", "osqp", "osqp-condensed"},
            "of the quadratic program: exact, or the paper's OSQP on the sparse or the condensed "
            "problem",
            kWithoutOsqp),
       number(key("osqp_tolerance"), s.osqp_tolerance, kOne, {1e-6, 0.1},
              "of OSQP, absolute and relative; its default is 1e-3")});
}

void add_estimator(EstimatorSettings& s, std::vector<Field>& list) {
  const auto key = [](std::string_view name) { return fmt::format("estimator.{}", name); };
  list.insert(
      list.end(),
      {word(key("kind"), s.kind, {"ekf", "mhe", "posterior"},
            "extended Kalman filter or moving horizon estimator, for temperature and alpha; "
            "posterior: all quantities of [[prior]] from all samples"),
       integer(key("window"), s.window, 2, kMaxWindow, "control samples in the moving horizon"),
       number(key("absorption_initial"), s.absorption_initial, kOne, {0.05, 5},
              "alpha before the first sample, from absorption_min to absorption_max"),
       number(key("absorption_sigma_initial"), s.absorption_sigma_initial, kOne, {0, 2, true},
              "its standard deviation"),
       number(key("absorption_min"), s.absorption_min, kOne, {0.05, 5},
              "alpha is kept at or above"),
       number(key("absorption_max"), s.absorption_max, kOne, {0.05, 5},
              "alpha is kept at or below"),
       number(key("absorption_process_noise"), s.absorption_process_noise, kOne, {0, 0.1},
              "standard deviation (variance: its square) added to alpha per control sample"),
       number(key("power_process_noise_W"), s.power_process_noise, kWatt, {0, 0.01},
              "standard deviation per control sample of an unknown power that enters as the "
              "laser does; stands for model error"),
       number(key("measurement_noise_K"), s.measurement_noise, kKelvin, {0, 20, true},
              "standard deviation of the volume temperature, as configured below, per control "
              "sample"),
       number(key("outlier_sigma"), s.outlier_sigma, kOne, {0, 100},
              "a sample this many standard deviations from its prediction is rejected, and the "
              "gate doubles with each; 0: never, else from 3"),
       word(key("unknowns"), s.unknowns, {"rpe", "rpe-and-choroid"},
            "alpha, or alpha and beta, which needs a layer with scaled_by = \"beta\""),
       number(key("choroid_initial"), s.choroid_initial, kOne, {0.05, 20},
              "beta before the first sample; constant where it is not estimated"),
       number(key("choroid_sigma_initial"), s.choroid_sigma_initial, kOne, {0, 2, true},
              "its standard deviation"),
       number(key("choroid_min"), s.choroid_min, kOne, {0.05, 20}, "beta is kept at or above"),
       number(key("choroid_max"), s.choroid_max, kOne, {0.05, 20}, "beta is kept at or below"),
       number(key("choroid_process_noise"), s.choroid_process_noise, kOne, {0, 0.1},
              "standard deviation added to beta per control sample"),
       number(key("sample_averaging_periods"), s.timing.averaging, kPeriods, {0, 1},
              "known of the samples: means over so much; the three at most 1 in sum"),
       number(key("sample_lag_periods"), s.timing.sample_lag, kPeriods, {0, 1},
              "known of the samples: so late"),
       number(key("power_lag_periods"), s.timing.power_lag, kPeriods, {0, 1},
              "known of the power: acts so late")});
}

void add_safety(SafetySettings& s, std::vector<Field>& list) {
  const auto key = [](std::string_view name) { return fmt::format("safety.{}", name); };
  list.insert(
      list.end(),
      {word(key("supervisor"), s.supervised, {"off", "on"},
            "on: checks samples and commands, lowers or refuses powers, stops; off: the paper"),
       number(key("power_rise_max_W"), s.power_rise_max, kWatt, {0, 1, true},
              "largest rise of the power from one period to the next"),
       number(key("energy_max_mJ"), s.energy_max, {"mJ", -3}, {0, 60000, true},
              "emitted in one treatment; then it is done"),
       number(key("exposure_max_ms"), s.exposure_max, kMilliseconds, {0, 60000, true},
              "time with light in one treatment; then it is done"),
       number(key("thermal_dose_max"), s.thermal_dose_max, kOne, {0, 1e6},
              "Arrhenius integral (schlott_2012) at which the treatment is done; 0: not limited"),
       number(key("power_accuracy_relative"), s.power_accuracy, kOne, {0, 0.5},
              "what an outside power meter leaves open of the true power; the gate keeps it as a "
              "margin"),
       number(key("sample_gain_accuracy_relative"), s.sample_gain_accuracy, kOne, {0, 0.5},
              "the same of the samples' gain, by an outside temperature standard"),
       word(key("real_time"), s.real_time, {"observe", "enforce"},
            "enforce: refuse without SCHED_FIFO and locked memory, strict about overruns and held "
            "powers; observe: a simulated eye only"),
       integer(key("core"), s.core, -1, 1023,
               "core that the loop of `treat` is pinned to, best an isolated one; -1: none")});
}

void add_model(ModelSettings& s, std::vector<Field>& list) {
  list.insert(
      list.end(),
      {Field{"model.file", TextField{&s.file, true},
             "a reduced model made by `photocoag reduce`; empty: reduce now (cached)"},
       integer("model.order", s.reduction.order, 1, 14, "states of the reduced model"),
       discretization("model.discretization", s.discretization,
                      "exact for constant power, the paper's scheme, or one of second order"),
       word("model.method", s.reduction.method,
            {kReductionMethodWords.begin(), kReductionMethodWords.end()},
            "what spans the reduced states; the paper's: POD over alpha"),
       word("model.refinement", s.reduction.refinement,
            {kRefinementWords.begin(), kRefinementWords.end()},
            "fits the projected model's numbers to the full-order model's responses"),
       word("model.parameter_dependence", s.reduction.parameter_dependence,
            {kParameterDependenceWords.begin(), kParameterDependenceWords.end()},
            "of inputs and volume output on alpha; method \"taylor\" uses its own series"),
       integer("model.parameter_terms", s.reduction.parameter_terms, 0, 12,
               "its number of terms; 0: 8 for \"chebyshev\", else 5; with beta 12 and 8"),
       number("model.choroid_min", s.reduction.choroid_min, kOne, {0.05, 20},
              "the model is made and its error measured for beta from here"),
       number("model.choroid_max", s.reduction.choroid_max, kOne, {0.05, 20},
              "to here; beta counts where a layer has scaled_by = \"beta\"")});
}

void add_tissue(std::string_view prefix, Tissue& t, std::vector<Field>& list) {
  const auto key = [prefix](std::string_view name) { return fmt::format("{}.{}", prefix, name); };
  list.insert(
      list.end(),
      {number(key("ambient_C"), t.ambient_celsius, {"deg C"}, {-10, 60},
              "absolute temperature = ambient + rise"),
       number(key("domain_radius_um"), t.domain_radius, kMicrometres, {1, 20000},
              "no temperature rise there; 2 to 2000 times spot_radius_um"),
       number(key("spot_radius_um"), t.spot_radius, kMicrometres, {0.01, 5000},
              "of the flat top; where the Gaussian has 1/e2 of its intensity"),
       word(key("beam"), t.beam,
            {to_string(BeamProfile::kFlatTop), to_string(BeamProfile::kGaussian),
             to_string(BeamProfile::kTable)},
            "the beam's profile, and the weight over the radius of the volume temperature"),
       numbers(key("beam_radius_um"), t.beam_radii, kMicrometres, {0, 20000},
               "ascending, up to domain_radius_um; of the table, else empty"),
       numbers(key("beam_intensity"), t.beam_intensities, kOne, {0, 1e6},
               "relative, one per radius; linear between them, 0 beyond the last"),
       number(key("transmission"), t.transmission, kOne, {0, 1, true},
              "power at the fundus / commanded power"),
       number(key("density_kg_per_m3"), t.density, {"kg/m3"}, {1, 1e5}, "of the tissue"),
       number(key("heat_capacity_J_per_kgK"), t.heat_capacity, {"J/(kg K)"}, {1, 1e5},
              "specific, of the tissue"),
       number(key("conductivity_W_per_mK"), t.conductivity, {"W/(m K)"}, {1e-3, 1e3},
              "thermal, of the tissue"),
       word(key("volume_temperature"), t.volume_temperature,
            {to_string(VolumeTemperature::kAbsorptionWeighted),
             to_string(VolumeTemperature::kNormalized)},
            "the paper's C_vol, or the same divided by the absorbed fraction"),
       Field{key("peak_layer"), TextField{&t.peak_layer},
             "the name of a layer: the peak temperature is at its mid-depth"},
       Field{
           key("layers"), LayersField{&t.layers},
           "1 to 32, in the order in which the light meets them; thickness 0.01 to 20000 "
           "um;\nabsorption 0 to 1e7 1/m, times alpha or beta where scaled_by = \"alpha\" or "
           "\"beta\".\nOptional: conductivity_W_per_mK, density_kg_per_m3, heat_capacity_J_per_kgK "
           "(else the "
           "tissue's), "
           "perfusion_W_per_m3K (else 0; 0 to 1e8)"}});
}

void add_plant(PlantSettings& s, std::vector<Field>& list) {
  list.insert(
      list.end(),
      {word("plant.model", s.model, {"full", "reduced"},
            "the full-order model of [grid], or a reduced one"),
       number("plant.absorption_factor", s.absorption_factor, kOne, {0.05, 5}, "the true alpha"),
       number("plant.choroid_factor", s.choroid_factor, kOne, {0.05, 20},
              "the true beta; 1 unless a layer has scaled_by = \"beta\""),
       number("plant.noise_K", s.noise, kKelvin, {0, 20}, "standard deviation per control sample"),
       number("plant.sample_averaging_periods", s.bench.timing.averaging, kPeriods, {0, 1},
              "the sample is the mean of the volume temperature over so much of a period; 0: its "
              "value"),
       number("plant.sample_lag_periods", s.bench.timing.sample_lag, kPeriods, {0, 1},
              "and shows what was so long before the period's end"),
       number("plant.power_lag_periods", s.bench.timing.power_lag, kPeriods, {0, 1},
              "a power acts so late, and so much longer"),
       word("plant.power_readback", s.bench.readback, {"emitted", "none"},
            "mean of the emitted power over the period, or none: the command is taken for it"),
       number("plant.power_gain", s.bench.power_gain, kOne, {0.5, 2}, "emitted / commanded power"),
       number("plant.sample_gain", s.bench.sample_gain, kOne, {0.5, 2},
              "shown / true volume temperature, the noise aside"),
       number("plant.absorption_drift_per_s", s.bench.absorption_drift, {"1/s"}, {-10, 10},
              "of the true alpha, relative to absorption_factor, linear in time; from 0.05 to 5"),
       word("plant.zero_power_sample", s.zero_power_sample, {"measured", "missing"},
            "missing: a single laser measures only while it emits; then see control.power_min_W"),
       discretization("plant.discretization", s.discretization,
                      "exact for constant power, the paper's scheme, or one of second order")});
}

void add_photoacoustics(PhotoacousticSettings& s, std::vector<Field>& list) {
  const auto key = [](std::string_view name) { return fmt::format("photoacoustics.{}", name); };
  list.insert(
      list.end(),
      {word(key("sampling"), s.sampling, {"instant", "pulses"},
            "of a control sample: at the end of its period, or the mean over its pulses, each "
            "just before its own heat; treat --device eye sets \"pulses\""),
       Field{key("calibration"), TextField{&s.calibration, true},
             "the Grueneisen curve made by `photocoag calibrate`; empty: water-like, not verified"},
       number(key("pulse_period_ms"), s.pulse_period, kMilliseconds, {0.02, 10},
              "of the laser; a whole fraction of control.period_ms"),
       integer(key("baseline_pulses"), s.baseline_pulses, 16, 100000,
               "of cold tissue before a treatment"),
       Field{key("eye_calibration"), TextField{&s.eye_calibration, true},
             "the simulated eye's true curve; empty: that of calibration"},
       word(key("eye_noise"), s.eye_noise, {"temperature", "voltage"},
            "of the simulated eye: the same in K, or in volts (plant.noise_K at 2.6 uJ, cold)"),
       word(key("eye_pacing"), s.eye_pacing, {"auto", "wall", "lockstep"},
            "of the simulated eye's process: by the clock, in lockstep with the controller (real "
            "time is then not measured), or auto: the clock where both keep it")});
}

void add_uncertainty(UncertaintySettings& s, std::vector<Field>& list) {
  list.insert(list.end(),
              {number("uncertainty.spot_radius_relative", s.spot_radius, kOne, {0, 0.5},
                      "relative, either way: 0.1 is 10 %"),
               number("uncertainty.thickness_relative", s.thickness, kOne, {0, 0.5},
                      "the same, of every layer by itself"),
               number("uncertainty.absorption_relative", s.absorption, kOne, {0, 0.5},
                      "the same, of the layers that alpha does not scale (the choroid)")});
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
  add_control(config.control, list);
  add_estimator(config.estimator, list);
  add_safety(config.safety, list);
  add_model(config.model, list);
  list.push_back(integer("grid.min_cells", config.grid.min_cells, 1000, 1'000'000,
                         "the grid has at least so many cells; the paper: more than 80000"));
  add_tissue("tissue", config.tissue, list);
  add_uncertainty(config.uncertainty, list);
  add_plant(config.plant, list);
  add_tissue("plant.tissue", config.plant.tissue, list);
  add_photoacoustics(config.photoacoustics, list);
  list.push_back(number("run.duration_ms", config.run.duration, kMilliseconds, {0, 60000, true},
                        "at least one control period, at most 1000000 of them"));
  list.push_back(word("run.goal", config.run.goal, {"duration", "hold", "dose"},
                      "what ends the treatment: duration_ms; hold_ms at the reference; the dose. "
                      "duration_ms is the longest it may last"));
  list.push_back(number("run.hold_ms", config.run.hold, kMilliseconds, {0, 60000, true},
                        "with goal \"hold\": time with an estimated peak of at least 95 % of "
                        "control.peak_reference_K"));
  list.push_back(number("run.dose", config.run.dose, kOne, {0, 1e6, true},
                        "with goal \"dose\": Arrhenius integral (schlott_2012) at the estimated "
                        "peak; 1 stands for damage"));
  list.push_back(integer("run.seed", config.run.seed, 0, std::numeric_limits<std::int64_t>::max(),
                         "of the simulated measurement noise"));
  return list;
}

std::vector<Field> layer_fields(Layer& layer, const std::string& prefix) {
  return {
      Field{prefix + ".name", TextField{&layer.name}, "unique"},
      number(prefix + ".thickness_um", layer.thickness, kMicrometres, {0.01, 20000}, "thickness"),
      number(prefix + ".absorption_per_m", layer.absorption, {"1/m"}, {0, 1e7},
             "absorption coefficient"),
      Field{prefix + ".scaled_by",
            WordField{{"none", "alpha", "beta"},
                      [&layer] {
                        return layer.scaled_by_alpha ? std::size_t{1}
                                                     : std::size_t{layer.scaled_by_beta ? 2U : 0U};
                      },
                      [&layer](std::size_t index) {
                        layer.scaled_by_alpha = index == 1;
                        layer.scaled_by_beta = index == 2;
                      },
                      {}},
            "alpha, beta: multiplied by it"},
      optional_number(prefix + ".conductivity_W_per_mK", layer.conductivity, {"W/(m K)"},
                      {1e-3, 1e3}, "thermal; else the tissue's"),
      optional_number(prefix + ".density_kg_per_m3", layer.density, {"kg/m3"}, {1, 1e5},
                      "else the tissue's"),
      optional_number(prefix + ".heat_capacity_J_per_kgK", layer.heat_capacity, {"J/(kg K)"},
                      {1, 1e5}, "specific; else the tissue's"),
      number(prefix + ".perfusion_W_per_m3K", layer.perfusion, {"W/(m3 K)"}, {0, 1e8},
             "heat carried away by blood at ambient")};
}

}  // namespace photocoag
