// The defaults, as the outside may rely on them: read from the contract's text, written as literals
// here, and in the settings. All three agree bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "config/temporary_folder.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kContract = R"([control]                          # the paper's problem
period_ms           = 1.0
horizon             = 5            # N, 2 to 50
peak_reference_K    = 30.0
peak_max_K          = 32.0
power_max_W         = 0.1          # above 0, at most 1
power_min_W         = 0.0
state_weight        = "constant"   # R0 = 1, or "delayed"
power_weight        = 0.0          # R1, K2/W2
power_change_weight = 0.0          # R2, K2/W2
reference_times_ms  = []           # beyond the contract, down to solve_every
reference_K         = []
robust              = "none"
robust_sigma        = 4.0
limit_probability   = 1e-3
identification_ms   = 0.0
identification_power_W = 0.02
identification_sigma_K = 0.0
delay_cycles        = 0
solve_every         = 1
first_power_W       = 0.0
solver              = "dense"      # or "osqp"
osqp_tolerance      = 1e-3         # beyond the contract

[estimator]
kind                     = "ekf"
window                   = 20
absorption_initial       = 0.7363
absorption_sigma_initial = 0.25
absorption_min           = 0.2
absorption_max           = 2.0
absorption_process_noise = 1e-5
measurement_noise_K      = 0.288
power_process_noise_W    = 4e-4
outlier_sigma            = 6.0
unknowns = "rpe"
choroid_initial = 1.0
choroid_sigma_initial = 0.3
choroid_min = 0.4
choroid_max = 2.5
choroid_process_noise = 1e-5
sample_averaging_periods = 0.0
sample_lag_periods = 0.0
power_lag_periods = 0.0

[safety]
supervisor       = "on"
power_rise_max_W = 0.1
energy_max_mJ    = 6000.0
exposure_max_ms  = 60000.0
thermal_dose_max = 0.0
power_accuracy_relative = 0.0
sample_gain_accuracy_relative = 0.0
real_time        = "observe"
core             = -1

[model]                            # what the controller believes
file                = ""
order               = 6
discretization      = "zero-order-hold"   # or "implicit-euler" (the paper's)
method              = "pod-deim"
refinement          = "output-error"
parameter_dependence = "deim"
parameter_terms      = 0
choroid_min = 0.5
choroid_max = 2.0

[grid]
min_cells = 80000

[tissue]                           # what the model is built from
ambient_C          = 22.0
domain_radius_um   = 2000.0
spot_radius_um     = 100.0
beam               = "flat-top"    # or "gaussian", "table"
beam_radius_um     = []
beam_intensity     = []
transmission       = 1.0           # power at the fundus / commanded power
density_kg_per_m3       = 993.0
heat_capacity_J_per_kgK = 4176.0
conductivity_W_per_mK   = 0.627
volume_temperature = "absorption-weighted"   # the paper's C_vol, not normalized; or "normalized"
peak_layer         = "RPE"         # its mid-depth is z_center
layers = [                         # in the order in which the light meets them
  { name = "retina",      thickness_um = 190.0, absorption_per_m = 0.0 },
  { name = "RPE",         thickness_um = 6.0,   absorption_per_m = 120400.0, scaled_by = "alpha" },
  { name = "unpigmented", thickness_um = 4.0,   absorption_per_m = 0.0 },
  { name = "choroid",     thickness_um = 400.0, absorption_per_m = 2662.2 },
  { name = "sclera",      thickness_um = 700.0, absorption_per_m = 0.0 },
]

[uncertainty]
spot_radius_relative = 0.0
thickness_relative   = 0.0
absorption_relative  = 0.0

[plant]                            # the simulated eye
model               = "full"       # or "reduced"
absorption_factor   = 1.1          # the true alpha
choroid_factor = 1.0
noise_K             = 0.288
sample_averaging_periods = 0.0
sample_lag_periods = 0.0
power_lag_periods = 0.0
power_readback = "emitted"
power_gain = 1.0
sample_gain = 1.0
sample_offset_K = 0.0
absorption_drift_per_s = 0.0
zero_power_sample = "measured"
discretization      = "zero-order-hold"

[photoacoustics]
sampling         = "instant"
calibration      = ""
pulse_period_ms  = 0.1
baseline_pulses  = 2000
eye_calibration  = ""
eye_noise        = "temperature"
eye_pacing       = "auto"

[run]
duration_ms = 250.0
goal = "duration"
hold_ms = 100.0
dose = 1.0
seed        = 1
)";

void expect_contract(const Config& c) {
  EXPECT_EQ(c.control.period, 1e-3);
  EXPECT_EQ(c.control.horizon, 5);
  EXPECT_EQ(c.control.peak_reference, 30.0);
  EXPECT_EQ(c.control.peak_max, 32.0);
  EXPECT_EQ(c.control.power_max, 0.1);
  EXPECT_EQ(c.control.power_min, 0.0);
  EXPECT_EQ(c.control.state_weight, StateWeight::kConstant);
  EXPECT_EQ(c.control.power_weight, 0.0);
  EXPECT_EQ(c.control.power_change_weight, 0.0);
  EXPECT_EQ(c.control.solver, SolverKind::kDense);
  EXPECT_EQ(c.estimator.kind, EstimatorKind::kEkf);
  EXPECT_EQ(c.estimator.absorption_initial, 0.7363);
  EXPECT_EQ(c.estimator.absorption_sigma_initial, 0.25);
  EXPECT_EQ(c.estimator.absorption_min, 0.2);
  EXPECT_EQ(c.estimator.absorption_max, 2.0);
  EXPECT_EQ(c.estimator.absorption_process_noise, 1e-5);
  EXPECT_EQ(c.estimator.power_process_noise, 4e-4);
  EXPECT_EQ(c.estimator.measurement_noise, 0.288);
  EXPECT_EQ(c.estimator.outlier_sigma, 6.0);
  EXPECT_EQ(c.model.file, "");
  EXPECT_EQ(c.model.reduction.order, 6);
  EXPECT_EQ(c.model.reduction.method, ReductionMethod::kPodDeim);
  EXPECT_EQ(c.model.discretization, Discretization::kZeroOrderHold);
  EXPECT_EQ(c.grid.min_cells, 80000U);
  EXPECT_EQ(c.plant.model, PlantModel::kFull);
  EXPECT_EQ(c.plant.absorption_factor, 1.1);
  EXPECT_EQ(c.plant.noise, 0.288);
  EXPECT_EQ(c.plant.discretization, Discretization::kZeroOrderHold);
  EXPECT_FALSE(c.plant.tissue_differs);
  EXPECT_EQ(c.plant.tissue, c.tissue);
  EXPECT_EQ(c.run.duration, 0.25);
  EXPECT_EQ(c.run.seed, 1U);
  EXPECT_EQ(c.cycles(), 250U);
}

void expect_contract(const Tissue& t) {
  EXPECT_EQ(t.ambient_celsius, 22.0);
  EXPECT_EQ(t.domain_radius, 2e-3);
  EXPECT_EQ(t.spot_radius, 100e-6);
  EXPECT_EQ(t.transmission, 1.0);
  EXPECT_EQ(t.density, 993.0);
  EXPECT_EQ(t.heat_capacity, 4176.0);
  EXPECT_EQ(t.conductivity, 0.627);
  EXPECT_EQ(t.volume_temperature, VolumeTemperature::kAbsorptionWeighted);
  EXPECT_EQ(t.peak_layer, "RPE");
  ASSERT_EQ(t.layers.size(), 5U);
  EXPECT_EQ(t.layers[0], (Layer{"retina", 190e-6, 0.0}));
  EXPECT_EQ(t.layers[1], (Layer{"RPE", 6e-6, 120400.0, ScaledBy::kAlpha}));
  EXPECT_EQ(t.layers[2], (Layer{"unpigmented", 4e-6, 0.0}));
  EXPECT_EQ(t.layers[3], (Layer{"choroid", 400e-6, 2662.2}));
  EXPECT_EQ(t.layers[4], (Layer{"sclera", 700e-6, 0.0}));
}

TEST(ConfigDefaults, ContractsTextGivesTheDefaults) {
  const TemporaryFolder folder;
  const Config read = load_config(folder.write("contract.toml", kContract), {});
  expect_contract(read);
  expect_contract(read.tissue);
  EXPECT_EQ(read, Config{});
}

TEST(ConfigDefaults, NothingGivenIsTheDefaults) {
  const Config config = load_config("", {});
  expect_contract(config);
  expect_contract(config.tissue);
}

TEST(ConfigDefaults, EveryKeyOfTheContractIsInTheTableAndNoOther) {
  std::string keys;
  Config config;
  for (const Field& field : fields(config)) {
    if (field.key.starts_with("plant.tissue.")) continue;
    keys += field.key.substr(field.key.find('.') + 1) + "\n";
  }
  std::string expected;
  std::size_t count = 0;
  for (std::string_view rest = kContract; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(line.size() + 1);
    if (line.empty() || std::string_view("[ ]").find(line.front()) != std::string_view::npos) {
      continue;
    }
    const std::string key(line.substr(0, line.find(' ')));
    EXPECT_NE(("\n" + keys).find("\n" + key + "\n"), std::string::npos) << key;
    ++count;
  }
  EXPECT_EQ(static_cast<std::size_t>(std::count(keys.begin(), keys.end(), '\n')), count);
}

// The ranges that are printed are those that validate() enforces.
TEST(ConfigDefaults, StatedRangesAreTheEnforcedOnes) {
  Config config;
  for (const Field& field : fields(config)) {
    const auto* number = std::get_if<NumberField>(&field.value);
    if (number == nullptr) continue;
    const auto refused = [&](double value) -> std::string {
      try {
        load_config("", {field.key + " = " + std::to_string(value)});
      } catch (const Error& error) {
        return error.parts().key + ": " + error.parts().accepted;
      }
      return "";
    };
    const Range& range = number->range;
    const double step = 1e-3 * (range.high - range.low);
    EXPECT_EQ(refused(range.low - step).substr(0, field.key.size()), field.key);
    EXPECT_EQ(refused(range.high + step).substr(0, field.key.size()), field.key);
    // At the ends: accepted, or refused only because of another value.
    for (const double end : {range.low, range.high}) {
      const std::string message = refused(end);
      const bool at_range = message.find("a number ") != std::string::npos ||
                            message.find("in watts") != std::string::npos;
      const bool excluded = range.above_low && end == range.low;
      if (field.key == "run.duration_ms") continue;  // its lower end is the period
      EXPECT_EQ(at_range, excluded) << field.key << " = " << end << ": " << message;
    }
  }
}

TEST(ConfigDefaults, IntegerRangesAreTheEnforcedOnes) {
  Config config;
  for (const Field& field : fields(config)) {
    const auto* integer = std::get_if<IntegerField>(&field.value);
    if (integer == nullptr) continue;
    const auto set = [&](std::int64_t value) {
      // solve_every has to be below the horizon.
      return load_config("", {"control.horizon=50", field.key + "=" + std::to_string(value)});
    };
    EXPECT_NO_THROW(set(integer->low)) << field.key;
    EXPECT_NO_THROW(set(integer->high)) << field.key;
    EXPECT_THROW(set(integer->low - 1), Error) << field.key;
    if (integer->high == std::numeric_limits<std::int64_t>::max()) continue;
    EXPECT_THROW(set(integer->high + 1), Error) << field.key;
    integer->set(integer->high + 1);  // and by validate() alone
    EXPECT_THROW(config.validate(), Error) << field.key;
    config = Config{};
  }
}

}  // namespace
}  // namespace photocoag
