#include "photocoag/fault_table/fault_table.hpp"

#include <fmt/format.h>

#include <limits>
#include <utility>

namespace photocoag {
namespace {

using R = SafetyReason;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

void add_measurement(std::vector<FaultCase>& table) {
  const auto go_on = [&](std::string id, std::string what, Fault fault, std::uint64_t count,
                         R reason, double value = 0.0) {
    std::vector<R> reasons = {reason};
    // Before the first sample there is none to repeat: then it counts as missing.
    if (reason == R::kSampleStale) reasons.push_back(R::kSampleMissing);
    table.push_back({.id = std::move(id),
                     .what = std::move(what),
                     .injection = {.fault = fault, .count = count, .value = value},
                     .demand = Demand::kContinue,
                     .reasons = std::move(reasons),
                     .margin = 1.0,
                     .estimator_deaf = true});
  };
  const auto stop = [&](std::string id, std::string what, Fault fault, std::uint64_t count,
                        int off_within, std::vector<R> reasons, double value = 0.0) {
    table.push_back({.id = std::move(id),
                     .what = std::move(what),
                     .injection = {.fault = fault, .count = count, .value = value},
                     .reasons = std::move(reasons),
                     .off_within = off_within,
                     .margin = 1.0});
  };
  go_on("M1", "1 sample missing", Fault::kMissing, 1, R::kSampleMissing);
  go_on("M1", "2 samples missing", Fault::kMissing, 2, R::kSampleMissing);
  stop("M2", "3 samples missing", Fault::kMissing, 3, 2, {R::kSampleMissing});
  go_on("M3", "same sequence once", Fault::kSameSequence, 1, R::kSampleStale);
  go_on("M3", "same sequence twice", Fault::kSameSequence, 2, R::kSampleStale);
  stop("M3", "same sequence for ever", Fault::kSameSequence, kPermanent, 2,
       {R::kSampleStale, R::kSampleMissing});
  go_on("M3", "too old twice", Fault::kOld, 2, R::kSampleStale);
  stop("M3", "too old for ever", Fault::kOld, kPermanent, 2, {R::kSampleStale, R::kSampleMissing});
  stop("M4", "code frozen", Fault::kStuck, kPermanent, 4,
       {R::kSampleStuck, R::kSampleRejected, R::kMeasurementNoise, R::kInconsistent});
  go_on("M5", "NaN once", Fault::kNotANumber, 1, R::kSampleMissing);
  stop("M5", "NaN 3 times", Fault::kNotANumber, 3, 2, {R::kSampleMissing});
  stop("M5", "infinity 3 times", Fault::kInfinite, 3, 2, {R::kSampleMissing});
  for (const auto& [what, fault] : {std::pair{"-0.0 once", Fault::kNegativeZero},
                                    std::pair{"denormal once", Fault::kDenormal}}) {
    table.push_back({.id = "M5",
                     .what = what,
                     .injection = {.fault = fault},
                     .demand = Demand::kLegal,
                     .reasons = {},
                     .margin = 1.0});
  }
  go_on("M6", "at the rail once", Fault::kRail, 1, R::kSampleSaturated);
  stop("M6", "at the rail twice", Fault::kRail, 2, 1, {R::kSampleSaturated});
  go_on("M7", "spike of +25 K", Fault::kSpike, 1, R::kSampleRejected, 25.0);
  go_on("M7", "spike of -25 K", Fault::kSpike, 1, R::kSampleRejected, -25.0);
  // Too small or too early to be distinguished from another absorption: an estimator that follows
  // it may be stopped as inconsistent.
  for (const double size : {1.0, 2.0, 3.0, 6.0, 12.0}) {
    for (const double sign : {1.0, -1.0}) {
      table.push_back({.id = "M7",
                       .what = fmt::format("spike of {:+g} K", sign * size),
                       .injection = {.fault = Fault::kSpike, .value = sign * size},
                       .demand = Demand::kContinueOrStop,
                       .reasons = {},
                       .margin = 1.0});
    }
  }
  stop("M7", "3 spikes among 20", Fault::kSpike, 11, 10, {R::kSampleRejected, R::kMeasurementNoise},
       25.0);
  table.back().injection.every = 5;
  for (const double factor : {4.0, 10.0}) {
    stop("M8", fmt::format("noise x{:g}", factor), Fault::kNoise, kPermanent, 50,
         {R::kMeasurementNoise, R::kSampleRejected, R::kInconsistent}, factor);
  }
  const auto either = [&](std::string what, Fault fault, double value) {
    table.push_back({.id = "M8",
                     .what = std::move(what),
                     .injection = {.fault = fault, .count = kPermanent, .value = value},
                     .demand = Demand::kContinueOrStop,
                     .reasons = {},
                     .margin = 7.0});
  };
  either("noise x0.1", Fault::kNoise, 0.1);
  // Below -3 K: row O12.
  for (const double bias : {0.3, 1.0, 3.0, 6.0, 12.0, -0.3, -1.0, -3.0}) {
    either(fmt::format("bias {:+g} K", bias), Fault::kBias, bias);
  }
  // Less than 0.8: row O3.
  for (const double gain : {0.8, 0.9, 1.1, 1.2, 1.5, 2.0, -1.0, 0.0}) {
    either(fmt::format("gain x{:g}", gain), Fault::kGain, gain);
  }
  go_on("M9", "out of order once", Fault::kLateByOne, 1, R::kSampleStale);
  stop("M9", "out of order for ever", Fault::kLateByOne, kPermanent, 2,
       {R::kSampleStale, R::kSampleMissing});
  go_on("M9", "from the future once", Fault::kFuture, 1, R::kSampleStale);
  stop("M9", "from the future for ever", Fault::kFuture, kPermanent, 2,
       {R::kSampleStale, R::kSampleMissing});
}

void add_actuator(std::vector<FaultCase>& table) {
  const auto stop = [&](std::string id, std::string what, Fault fault, int off_within, R reason,
                        double value, bool interlock) {
    table.push_back({.id = std::move(id),
                     .what = std::move(what),
                     .injection = {.fault = fault, .count = kPermanent, .value = value},
                     .reasons = {reason},
                     .off_within = off_within,
                     .interlock = interlock});
  };
  for (const double factor : {1.5, 0.5, 1.25, 0.75, 10.0, 0.0, -1.0, kNan, kInf}) {
    stop("A1", fmt::format("readback x{:g}", factor), Fault::kReadback, 2, R::kPowerReadback,
         factor, true);
    // With 0 W in force any light is stuck on; ten times the power also does not fit the sample.
    table.back().reasons = {R::kPowerReadback, R::kPowerStuckOn, R::kMeasurementNoise};
  }
  // More than is commanded: row O11.
  for (const double factor : {0.75, 0.5, 0.0}) {
    stop("A1", fmt::format("laser x{:g}", factor), Fault::kLaser, 2, R::kPowerReadback, factor,
         true);
  }
  stop("A2", "stuck on at 20 mW", Fault::kStuckOn, 0, R::kPowerStuckOn, 0.02, true);
  stop("A3", "write fails", Fault::kWriteFails, 0, R::kWriteFailed, 0.0, true);
  stop("A4", "device vanishes", Fault::kGone, 2, R::kDeviceGone, 0.0, true);
  stop("A5", "shutter closes", Fault::kShutter, 0, R::kShutter, 0.0, false);
  stop("A5", "interlock opens", Fault::kInterlock, 0, R::kInterlock, 0.0, false);
  stop("A5", "foot switch released", Fault::kFootSwitch, 0, R::kFootSwitch, 0.0, false);
  table.back().demand = Demand::kStandby;
}

void add_software(std::vector<FaultCase>& table) {
  const auto once = [&](std::string id, std::string what, Fault fault, R reason, double value,
                        double margin = 0.5) {
    table.push_back({.id = std::move(id),
                     .what = std::move(what),
                     .injection = {.fault = fault, .count = 1, .value = value},
                     .demand = Demand::kContinue,
                     .reasons = {reason},
                     .margin = margin});
  };
  const auto lasting = [&](std::string id, std::string what, Fault fault, std::uint64_t count,
                           int off_within, std::vector<R> reasons, double value,
                           double margin = 0.5) {
    table.push_back({.id = std::move(id),
                     .what = std::move(what),
                     .injection = {.fault = fault, .count = count, .value = value},
                     .reasons = std::move(reasons),
                     .off_within = off_within,
                     .margin = margin});
  };
  once("S1", "infeasible once", Fault::kInfeasible, R::kInfeasible, 0.1);
  lasting("S1", "infeasible for ever", Fault::kInfeasible, kPermanent, 0, {R::kInfeasible}, 0.1);
  once("S2", "no answer once", Fault::kSolverFails, R::kSolverFailed, 0.1);
  lasting("S2", "no answer for ever", Fault::kSolverFails, kPermanent, 2, {R::kSolverFailed}, 0.1);
  once("S3", "NaN once", Fault::kCommand, R::kCommandInvalid, kNan);
  lasting("S3", "NaN for ever", Fault::kCommand, kPermanent, 2, {R::kCommandInvalid}, kNan);
  lasting("S3", "infinite for ever", Fault::kCommand, kPermanent, 2, {R::kCommandInvalid}, kInf);
  lasting("S3", "negative for ever", Fault::kCommand, kPermanent, 2, {R::kCommandInvalid}, -0.01);
  lasting("S3", "above u_max for ever", Fault::kCommand, kPermanent, 2, {R::kCommandInvalid}, 0.11);
  once("S4", "good solves after a bad one", Fault::kCommand, R::kCommandInvalid, kNan);
  table.push_back({.id = "E1",
                   .what = "estimator restarts cold once",
                   .injection = {.fault = Fault::kRestart},
                   .demand = Demand::kContinueOrStop,
                   .reasons = {R::kEstimatorRestart}});
  lasting("E1", "restarts twice", Fault::kRestart, 2, 2, {R::kEstimatorRestart, R::kInconsistent},
          0.0);
  once("E2", "alpha outside once", Fault::kAbsorption, R::kAbsorption, 0.1, 2.0);
  lasting("E2", "alpha outside for ever", Fault::kAbsorption, kPermanent, 9, {R::kAbsorption}, 0.1,
          2.0);
  lasting("E3", "innovations x10", Fault::kInnovation, kPermanent, 19, {R::kInconsistent}, 10.0);
  once("E4", "peak estimate too high once", Fault::kPeakEstimate, R::kEstimatedPeak, 33.5);
  lasting("E4", "peak estimate too high", Fault::kPeakEstimate, kPermanent, 0, {R::kEstimatedPeak},
          33.5);
}

void add_time_and_limits(std::vector<FaultCase>& table) {
  table.push_back({.id = "T1",
                   .what = "1 overrun",
                   .injection = {.fault = Fault::kOverrun, .count = 1},
                   .demand = Demand::kContinue,
                   .reasons = {R::kOverrun},
                   .margin = 1.0});
  table.push_back({.id = "T2",
                   .what = "2 overruns in a row",
                   .injection = {.fault = Fault::kOverrun, .count = 2},
                   .reasons = {R::kOverrun},
                   .margin = 1.0});
  table.push_back({.id = "T2",
                   .what = "2 overruns among 100",
                   .injection = {.fault = Fault::kTwoOverruns, .every = 20},
                   .reasons = {R::kOverrun},
                   .margin = 1.0});
  for (const R reason : {R::kEnergy, R::kExposure, R::kThermalDose}) {
    table.push_back({.id = "X1",
                     .what = "limit of " + std::string(to_string(reason)),
                     .injection = {},
                     .demand = Demand::kDone,
                     .reasons = {reason}});
  }
  table.push_back({.id = "X4",
                   .what = "bit flipped in the limits",
                   .injection = {.fault = Fault::kHook},
                   .reasons = {R::kLimitsCorrupted}});
}

/// Faults that cannot be detected from inside, or only after they have heated.
void add_open_hazards(std::vector<FaultCase>& table) {
  const auto open = [&](std::string id, std::string what, Injection injection) {
    injection.count = kPermanent;
    table.push_back({.id = std::move(id),
                     .what = std::move(what),
                     .injection = injection,
                     .demand = Demand::kReport,
                     .reasons = {}});
  };
  open("O1", "laser x1.25, samples x0.8", {.fault = Fault::kGains, .laser = 1.25, .samples = 0.8});
  open("O2", "readback x0.81, samples x0.8",
       {.fault = Fault::kGains, .readback = 0.81, .samples = 0.8});
  open("O3", "samples x0.7", {.fault = Fault::kGains, .samples = 0.7});
  open("O4", "laser x1.19, readback as commanded", {.fault = Fault::kGains, .laser = 1.19});
  open("O5", "readback x0.81", {.fault = Fault::kGains, .readback = 0.81});
  open("O6", "alpha jumps to 1.5", {.fault = Fault::kJump, .value = 1.5});
  open("O7", "alpha grows by 0.1 % per ms", {.fault = Fault::kDrift, .value = 1e-3});
  open("O8", "as O1, growing over 40 ms",
       {.fault = Fault::kGains, .laser = 1.25, .samples = 0.8, .ramp_ms = 40.0});
  open("O9", "as O4, growing over 40 ms", {.fault = Fault::kGains, .laser = 1.19, .ramp_ms = 40.0});
  open("O10", "laser at 30 mW whatever is commanded", {.fault = Fault::kLaserAt, .value = 0.03});
  for (const double factor : {1.25, 1.5}) {
    open("O11", fmt::format("laser x{:g}, readback right", factor),
         {.fault = Fault::kLaser, .value = factor});
  }
  for (const double bias : {-6.0, -12.0}) {
    open("O12", fmt::format("bias {:g} K", bias), {.fault = Fault::kBias, .value = bias});
  }
  for (const double lag : {0.5, 0.7}) {
    open("O13", fmt::format("samples {:g} of a period late", lag),
         {.fault = Fault::kLag, .sample_lag = lag});
  }
  open("O14", "samples are means over their period", {.fault = Fault::kLag, .averaging = 1.0});
  for (const double lag : {0.5, 0.7}) {
    open("O15", fmt::format("powers act {:g} of a period late, command read back", lag),
         {.fault = Fault::kLag, .power_lag = lag, .emitted_is_read = false});
  }
  for (const double lag : {0.5, 0.7}) {
    open("O16", fmt::format("powers act {:g} of a period late, mean read back", lag),
         {.fault = Fault::kLag, .power_lag = lag});
  }
  for (const double drift : {2e-4, -2e-4}) {
    open("O17", fmt::format("alpha drifts by {:+g} % per s", drift * 1e5),
         {.fault = Fault::kDrift, .value = drift});
  }
}

}  // namespace

std::vector<FaultCase> fault_table() {
  std::vector<FaultCase> table;
  add_measurement(table);
  add_actuator(table);
  add_software(table);
  add_time_and_limits(table);
  add_open_hazards(table);
  return table;
}

}  // namespace photocoag
