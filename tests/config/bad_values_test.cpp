// Bad values and keys: the message names the place, the key, what was found and what is accepted.
#include <gtest/gtest.h>

#include <algorithm>

#include "config/temporary_folder.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

std::string refusal(const std::string& file, const std::vector<std::string>& overrides) {
  try {
    load_config(file, overrides);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

// Given by --set; the whole message behind the place is `message`.
struct BadOverride {
  std::vector<std::string> set;
  std::string message;
};

const std::string kPeriod = "a number from 0.05 to 100 ms";

const std::vector<BadOverride> kOverrides = {
    // ranges
    {{"control.period_ms=-1"}, "control.period_ms: found -1; accepted: " + kPeriod},
    {{"tissue.layers.RPE.perfusion_W_per_m3K=-1"},
     "tissue.layers.RPE.perfusion_W_per_m3K: found -1; accepted: a number from 0 to 1e8 W/(m3 K)"},
    {{"tissue.layers.RPE.conductivity_W_per_mK=0"},
     "tissue.layers.RPE.conductivity_W_per_mK: found 0; accepted: a number from 0.001 to 1000 "
     "W/(m K)"},
    {{"tissue.heat_capacity_J_per_kgK=0.5"},
     "tissue.heat_capacity_J_per_kgK: found 0.5; accepted: a number from 1 to 100000 J/(kg K)"},
    {{"uncertainty.spot_radius_relative=0.1", "tissue.layers.choroid.scaled_by=beta",
      "estimator.unknowns=rpe-and-choroid"},
     "estimator.unknowns: found rpe-and-choroid; accepted: \"rpe\" where [uncertainty] "
     "declares anything"},
    {{"tissue.beam=gauss"},
     "tissue.beam: found \"gauss\"; accepted: \"flat-top\" or \"gaussian\" or "},
    {{"tissue.beam=table"}, "tissue.beam_radius_um: found 0 numbers; accepted: 2 to 256 radii"},
    {{"tissue.beam_radius_um=5"},
     "tissue.beam_radius_um: found 5 (an integer); accepted: an array of numbers, each 0 to 20000 "
     "um"},
    {{"tissue.beam_radius_um=[0, nan]"}, "tissue.beam_radius_um: found nan; accepted: an array of"},
    {{"control.period_ms=0"}, "control.period_ms: found 0; accepted: " + kPeriod},
    {{"control.period_ms=100.5"}, "control.period_ms: found 100.5; accepted: " + kPeriod},
    {{"control.period_ms=nan"}, "control.period_ms: found nan; accepted: " + kPeriod},
    {{"control.period_ms=-inf"}, "control.period_ms: found -inf; accepted: " + kPeriod},
    {{"control.period_ms=1e999"},
     "control.period_ms: found \"1e999\" (a string); accepted: " + kPeriod},
    {{"control.period_ms=1e-400"}, "control.period_ms: found 1e-400; accepted: " + kPeriod},
    {{"control.first_power_W=0.2"},
     "control.first_power_W: found 0.2; accepted: 0, or from control.power_min_W = 0 to "
     "control.power_max_W = 0.1 W"},
    {{"plant.power_lag_periods=1.5"},
     "plant.power_lag_periods: found 1.5; accepted: a number from 0 to 1 periods"},
    {{"plant.power_gain=0.4"}, "plant.power_gain: found 0.4; accepted: a number from 0.5 to 2"},
    {{"plant.absorption_drift_per_s=-11"},
     "plant.absorption_drift_per_s: found -11; accepted: a number from -10 to 10 1/s"},
    {{"plant.power_readback=off"},
     "plant.power_readback: found \"off\"; accepted: \"emitted\" or \"none\""},
    {{"plant.sample_lag_periods=0.5", "plant.discretization=implicit-euler"},
     "plant.discretization: found implicit-euler; accepted: \"zero-order-hold\" with lags, "},
    {{"plant.absorption_drift_per_s=1", "plant.tissue.layers.RPE.conductivity_W_per_mK=0.5"},
     "plant.tissue.layers: found layers that conduct differently; accepted: layers that conduct "
     "alike"},
    {{"estimator.sample_averaging_periods=1", "estimator.sample_lag_periods=0.25"},
     "estimator.sample_lag_periods: found 0.25; accepted: with sample_averaging_periods = 1 and "
     "power_lag_periods = 0 at most 1 in sum"},
    {{"estimator.power_lag_periods=0.25"},
     "plant.power_readback: found emitted; accepted: \"none\" with estimator.power_lag_periods"},
    {{"control.horizon=0"}, "control.horizon: found 0; accepted: an integer from 2 to 50"},
    {{"control.horizon=1"}, "control.horizon: found 1; accepted: an integer from 2 to 50"},
    {{"control.horizon=1000"}, "control.horizon: found 1000; accepted: an integer from 2 to 50"},
    {{"control.horizon=4294967298"},
     "control.horizon: found 4294967298; accepted: an integer from 2 to 50"},
    {{"control.power_max_W=100"},
     "control.power_max_W: found 100; accepted: a number above 0, at most 1 W (0.1 W is 100 mW)"},
    {{"control.power_max_W=0"}, "control.power_max_W: found 0; accepted: a number above 0"},
    {{"control.power_min_W=-0.1"},
     "control.power_min_W: found -0.1; accepted: a number from 0 to 1 W"},
    {{"control.power_weight=-1"}, "control.power_weight: found -1; accepted: a number from 0 to"},
    {{"control.power_change_weight=1e10"}, "control.power_change_weight: found 1e10; accepted: "},
    {{"estimator.absorption_sigma_initial=0"},
     "estimator.absorption_sigma_initial: found 0; accepted: a number above 0, at most 2"},
    {{"estimator.absorption_min=inf"},
     "estimator.absorption_min: found inf; accepted: a number from"},
    {{"estimator.measurement_noise_K=0"},
     "estimator.measurement_noise_K: found 0; accepted: a number above 0, at most 20 K"},
    {{"estimator.power_process_noise_W=1"},
     "estimator.power_process_noise_W: found 1; accepted: a number from 0 to 0.01 W"},
    {{"model.order=15"}, "model.order: found 15; accepted: an integer from 1 to 14"},
    {{"grid.min_cells=-1"}, "grid.min_cells: found -1; accepted: an integer from 1000 to 1000000"},
    {{"plant.absorption_factor=5.1"},
     "plant.absorption_factor: found 5.1; accepted: a number from 0.05 to 5"},
    {{"plant.noise_K=nan"}, "plant.noise_K: found nan; accepted: a number from 0 to 20 K"},
    {{"plant.noise_K=21"}, "plant.noise_K: found 21; accepted: a number from 0 to 20 K"},
    {{"tissue.conductivity_W_per_mK=0"},
     "tissue.conductivity_W_per_mK: found 0; accepted: a number "},
    {{"plant.tissue.transmission=1.1"},
     "plant.tissue.transmission: found 1.1; accepted: a number above 0, at most 1"},
    {{"tissue.layers.RPE.thickness_um=-1"},
     "tissue.layers.RPE.thickness_um: found -1; accepted: a number from 0.01 to 20000 um"},
    {{"plant.tissue.layers.RPE.absorption_per_m=1e8"},
     "plant.tissue.layers.RPE.absorption_per_m: found 1e8; accepted: a number from 0 to"},
    {{"run.seed=-1"}, "run.seed: found -1; accepted: an integer from 0 to 2^63 - 1"},
    {{"run.duration_ms=60001"},
     "run.duration_ms: found 60001; accepted: a number above 0, at most 60000 ms"},
    {{"run.duration_ms=0.5"},
     "run.duration_ms: found 0.5; accepted: at least one period, control.period_ms = 1 ms"},
    {{"control.period_ms=0.05", "run.duration_ms=60000"},
     "run.duration_ms: found 60000; accepted: at most 1000000 periods of control.period_ms = 0.05"},
    // values that do not go together
    {{"control.peak_max_K=30"},
     "control.peak_reference_K: found 30; accepted: below the limit control.peak_max_K = 30 K"},
    {{"control.peak_reference_K=40"},
     "control.peak_reference_K: found 40; accepted: below the limit control.peak_max_K = 32 K"},
    {{"control.power_min_W=0.1"},
     "control.power_min_W: found 0.1; accepted: from 0 to below control.power_max_W = 0.1 W"},
    {{"control.state_weight=delayed"}, "control.state_weight: found delayed with power_weight"},
    {{"estimator.absorption_max=0.5"},
     "estimator.absorption_initial: found 0.7363; accepted: from estimator.absorption_min = 0.2 to "
     "estimator.absorption_max = 0.5"},
    {{"estimator.absorption_min=3"},
     "estimator.absorption_max: found 2; accepted: above estimator.absorption_min = 3"},
    {{"tissue.spot_radius_um=1500"},
     "tissue.domain_radius_um: found 2000; accepted: at least twice tissue.spot_radius_um = "},
    {{"tissue.spot_radius_um=1e-6"},
     "tissue.spot_radius_um: found 1e-6; accepted: a number from 0.01 to 5000 um"},
    {{"tissue.spot_radius_um=0.9"},
     "tissue.domain_radius_um: found 2000; accepted: at most 2000 times tissue.spot_radius_um = "},
    {{"plant.tissue.spot_radius_um=1500"},
     "plant.tissue.domain_radius_um: found 2000; accepted: at least twice plant.tissue.spot_rad"},
    {{"tissue.peak_layer=RPF"},
     "tissue.peak_layer: found RPF; accepted: the name of one of tissue.layers"},
    // types and words
    {{"control.period_ms=\"1\""},
     "control.period_ms: found \"1\" (a string); accepted: " + kPeriod},
    {{"control.period_ms=true"}, "control.period_ms: found true (a boolean); accepted: " + kPeriod},
    {{"control.period_ms=[1]"}, "control.period_ms: found […] (an array); accepted: " + kPeriod},
    {{"control.period_ms.x=1"}, "control.period_ms: found {…} (a table); accepted: " + kPeriod},
    {{"control.period_ms=2020-01-01"},
     "control.period_ms: found 2020-01-01 (a date or time); accepted: " + kPeriod},
    {{"control.horizon=5.0"},
     "control.horizon: found 5.0 (a number); accepted: an integer from 2 to 50"},
#if !PHOTOCOAG_HAS_OSQP
    {{"control.solver=osqp"}, "control.solver: not available in this build, which found no OSQP 0"},
#else
    {{"control.solver=oSQP"},
     "control.solver: found \"oSQP\"; accepted: \"dense\" or \"osqp\" or \"osqp-condensed\""},
#endif
    {{"control.solver=1"}, "control.solver: found 1 (an integer); accepted: \"dense\""},
    {{"control.osqp_tolerance=0"},
     "control.osqp_tolerance: found 0; accepted: a number from 1e-06"},
    {{"control.state_weight=2"},
     "control.state_weight: found 2 (an integer); accepted: \"constant\" or \"delayed\""},
    {{"estimator.kind=ukf"}, "estimator.kind: found \"ukf\"; accepted: \"ekf\" or \"mhe\""},
    {{"model.method=pod"},
     "model.method: found \"pod\"; accepted: \"pod-deim\" or \"balanced\" or "
     "\"balanced-two-sided\" or \"irka\" or \"taylor\""},
    {{"model.discretization=zoh"},
     "model.discretization: found \"zoh\"; accepted: \"zero-order-hold\" or \"implicit-euler\""},
    {{"plant.model=FULL"}, "plant.model: found \"FULL\"; accepted: \"full\" or \"reduced\""},
    {{"model.file=1"}, "model.file: found 1 (an integer); accepted: a file name in quotes"},
    {{"model.file=\"a\\u0000b\""},
     "model.file: a control character; found \"a\\u0000b\"; accepted: a file name"},
    {{"model.file=" + std::string(5000, 'a')}, "model.file: 5000 bytes long; found \"aaa"},
    {{"control=5"}, "control: found 5 (an integer); accepted: [control]"},
    {{"plant.tissue=[]"}, "plant.tissue: found […] (an array); accepted: a table"},
    {{"tissue.layers=5"}, "tissue.layers: found 5 (an integer); accepted: an array of layers"},
    {{"tissue.layers=[5]"}, "tissue.layers: found 5 (an integer); accepted: { name = "},
    {{"tissue.layers.RPE=5"}, "tissue.layers.RPE: found 5 (an integer); accepted: keys of a layer"},
    {{"tissue.layers.RPE.scaled_by=gamma"},
     "tissue.layers.RPE.scaled_by: found \"gamma\"; accepted: \"none\" or \"alpha\" or \"beta\""},
    {{"tissue.layers.RPE.scaled_by=beta"},
     "tissue.layers: found no absorbing layer with scaled_by = \"alpha\"; accepted: at least one"},
    {{"plant.choroid_factor=1.5"},
     "plant.choroid_factor: found 1.5; accepted: 1, or an absorbing layer with scaled_by = "},
    {{"plant.choroid_factor=0"},
     "plant.choroid_factor: found 0; accepted: a number from 0.05 to 20"},
    {{"estimator.unknowns=rpe-and-choroid"},
     "estimator.unknowns: found rpe-and-choroid; accepted: \"rpe\", or an absorbing layer of "
     "[tissue] with scaled_by = \"beta\""},
    {{"estimator.unknowns=both"},
     "estimator.unknowns: found \"both\"; accepted: \"rpe\" or \"rpe-and-choroid\""},
    {{"estimator.choroid_initial=3"},
     "estimator.choroid_initial: found 3; accepted: from estimator.choroid_min = 0.4 to "
     "estimator.choroid_max = 2.5"},
    {{"model.choroid_min=2.5"},
     "model.choroid_max: found 2; accepted: above model.choroid_min = 2.5"},
    // layers
    {{"tissue.layers=[]"}, "tissue.layers: found 0; accepted: 1 to 32 layers"},
    {{"tissue.layers=[{name=\"a\", thickness_um=1}]"},
     "tissue.layers.a.absorption_per_m: missing; accepted: name, thickness_um and "
     "absorption_per_m"},
    {{"tissue.layers=[{thickness_um=1, absorption_per_m=1}]"}, "tissue.layers.….name: missing"},
    {{"tissue.layers=[{name=\"a\", thickness_um=1, absorption_per_m=1, colour=1}]"},
     "tissue.layers.a.colour: unknown key; accepted: name, thickness_um, absorption_per_m, scaled"},
    {{"tissue.layers=[{name=\"RPE\", thickness_um=1, absorption_per_m=1}, {name=\"RPE\", "
      "thickness_um=1, absorption_per_m=1}]"},
     "tissue.layers: found RPE; accepted: each name once"},
    {{"plant.tissue.layers=[{name=\"a\", thickness_um=1, absorption_per_m=1, "
      "scaled_by=\"alpha\"}]"},
     "plant.tissue.peak_layer: found RPE; accepted: the name of one of plant.tissue.layers"},
    {{"tissue.layers.RPE.thickness_um=5", "tissue.layers.RPE.scaled_by=none"},
     "tissue.layers: found no absorbing layer with scaled_by = \"alpha\"; accepted: at least one"},
    {{"tissue.layers.RPF.thickness_um=5"},
     "tissue.layers.RPF: no layer of that name; did you mean RPE?; accepted: retina, RPE, "
     "unpigmented, choroid, sclera"},
    {{"plant.tissue.layers.vitreous.thickness_um=5"},
     "plant.tissue.layers.vitreous: no layer of that name; accepted: retina, RPE, "},
    {{"tissue.layers.RPE.name=x"}, "tissue.layers.RPE.name: a layer cannot be renamed"},
    // keys
    {{"control.power_max_mW=100"},
     "control.power_max_mW: unknown key; did you mean control.power_max_W?"},
    {{"control.perod_ms=1"}, "control.perod_ms: unknown key; did you mean control.period_ms?"},
    {{"run.duration_s=1"}, "run.duration_s: unknown key; did you mean run.duration_ms?"},
    {{"period_ms=1"}, "period_ms: unknown key; did you mean control.period_ms?"},
    {{"contol.period_ms=1"}, "contol: unknown key; did you mean control?"},
    {{"control.noise_K=1"}, "control.noise_K: unknown key; did you mean plant.noise_K?"},
    {{"tissue.layers.RPE.thickness=5"},
     "tissue.layers.RPE.thickness: unknown key; did you mean tissue.layers.RPE.thickness_um?"},
    {{"plant.tissue.spot_radius=5"},
     "plant.tissue.spot_radius: unknown key; did you mean plant.tissue.spot_radius_um?"},
    {{"control.xyzzy=1"}, "control.xyzzy: unknown key; accepted: period_ms, horizon, "},
    {{"xyzzy.a=1"},
     "xyzzy: unknown key; accepted: control, estimator, safety, model, grid, tissue, uncertainty, "
     "plant"},
    {{"\"control.period_ms\"=1"},
     "\"control.period_ms\": unknown key; did you mean control.period_ms?"},
    {{"a.b.c.d.e.f.g.h.i.j.k.l=1"}, "a: unknown key; accepted: "},
};

TEST(BadOverrides, NamePlaceKeyFoundAndAccepted) {
  for (const auto& [set, message] : kOverrides) {
    const std::string place = "--set " + set.back();
    const std::string got = refusal("", set);
    const bool cut = set.back().size() > 80;  // a long option is cut in the message
    EXPECT_EQ(got.substr(0, std::min<std::size_t>(place.size(), cut ? 86 : 1000)),
              place.substr(0, cut ? 86 : 1000));
    EXPECT_NE(got.find(": " + message), std::string::npos) << got << "\nnot: " << message;
  }
}

TEST(BadOverrides, NotKeyValue) {
  EXPECT_EQ(refusal("", {"control.period_ms"}),
            "--set control.period_ms; accepted: key=value in one line, e.g. control.period_ms=2");
  for (const char* option : {"=3", " = 3", "#=3", "a b=3", "[control]=3", ".=3", "a..b=3"}) {
    EXPECT_NE(refusal("", {option}).find("no key before the equals sign"), std::string::npos)
        << option;
  }
  EXPECT_NE(refusal("", {"control.horizon=2\nrun.seed=3"}).find("in one line"), std::string::npos);
  EXPECT_NE(refusal("", {"model.file=\xff"}).find("text in UTF-8"), std::string::npos);
  EXPECT_NE(refusal("", {""}).find("accepted: key=value"), std::string::npos);
  EXPECT_NE(refusal("", {std::string(100000, '.') + "a=1"}).find("too many dots"),
            std::string::npos);
}

// In a file the place is the line of the value.
TEST(BadFiles, NameTheLine) {
  const TemporaryFolder folder;
  const auto expect = [&folder](std::string_view text, const std::string& message) {
    const std::string file = folder.write("bad.toml", text);
    const std::string got = refusal(file, {});
    EXPECT_EQ(got.substr(0, file.size() + 1 + message.size()), file + ":" + message);
  };
  expect("\n[control]\n\nperiod_ms = -1_0e-1\n",
         "4: control.period_ms: found -1_0e-1; accepted: a number from 0.05 to 100 ms");
  expect("[control]\r\npower_max_W = 100\r\n",
         "2: control.power_max_W: found 100; accepted: a num");
  expect("\xEF\xBB\xBF[control]\nhorizon = 1\n", "2: control.horizon: found 1; accepted: an integ");
  expect("[plant]\nnoise_K = inf # e\n", "2: plant.noise_K: found inf; accepted: a number from 0");
  expect("[plant]\n\"noise_K\" = 'é'\n", "2: plant.noise_K: found \"é\" (a string); accepted: ");
  expect("[control]\nperiod = 1\n", "2: control.period: unknown key; did you mean control.period_");
  expect("[[control]]\nperiod_ms = 1\n", "1: control: found […] (an array); accepted: [control]");
  expect("[controls]\nperiod_ms = 1\n", "1: controls: unknown key; did you mean control?");
  expect("[run]\nseed = 1\nx = 2\na = 3\n", "3: run.x: unknown key");  // in the order of the text
  expect("[tissue]\nlayers = [\n{ name = \"RPE\", thickness_um = 0.0, absorption_per_m = 1 },\n]\n",
         "3: tissue.layers.RPE.thickness_um: found 0.0; accepted: a number from 0.01 to 20000 um");
  expect(
      "control.peak_max_K = 20\n",
      "1: control.peak_reference_K: found 30; accepted: below the limit control.peak_max_K = 20");
  expect(
      "[tissue]\nspot_radius_um = 800\n[plant.tissue]\ndomain_radius_um = 900\n",
      "4: plant.tissue.domain_radius_um: found 900; accepted: at least twice plant.tissue.spot_");
}

}  // namespace
}  // namespace photocoag
