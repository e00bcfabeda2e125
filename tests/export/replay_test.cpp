// The exported controller gives the powers of the C++ one, cycle by cycle, in both precisions.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <iostream>

#include "export/replay.hpp"
#include "support/reduced_models.hpp"

namespace photocoag::testing {
namespace {

constexpr int kCyclesPerHorizon = 50000;

const ReducedModel& model_for(double period) {
  static const ReducedModel at_1khz = coarse_model({}, 1e-3);
  static const ReducedModel at_250hz = coarse_model({}, 4e-3);
  return period < 2e-3 ? at_1khz : at_250hz;
}

class Replay : public ::testing::TestWithParam<int> {};

// 1e-12 W and 1e-9 K: rounding, with the condition of the longest horizon.
constexpr ReplayDifference kDouble{.power = 1e-12, .peak = 1e-9};
// Where single precision is on the other side of a decision for some periods: the posterior takes
// another Gauss-Newton step, or expands anew, or it does not.
struct Across {
  ReplayDifference bars;
  double share;  // of the cycles
};
constexpr Across kNowhere{kSingleBar, 0.0};
constexpr Across kStep{{.power = 5e-4, .peak = 1e-1}, 1e-2};

Across decisions_of(const ReplayCase& one) {
  return one.estimator.kind == EstimatorKind::kPosterior ? kStep : kNowhere;
}

void expect_within(const ReplayDifference& difference, const ReplayDifference& bars) {
  EXPECT_LE(difference.power, bars.power) << "in cycle " << difference.worst;
  EXPECT_LE(difference.peak, bars.peak);
}

using ModelOf = std::function<ReducedModel(const ReplayCase&)>;

void powers_are_those_of_the_library(int horizon, const std::vector<ReplayCase>& cases,
                                     const ModelOf& model_of, int changes_one_in) {
  const int cycles = kCyclesPerHorizon / static_cast<int>(cases.size()) + 1;
  int limited = 0;
  int changed = 0;
  int all = 0;
  for (const ReplayCase& one : cases) {
    SCOPED_TRACE(one.name);
    const ReducedModel model = model_of(one);
    const std::vector<ReplayCycle> recorded = record(model, one, cycles, 18);
    const auto exported = [&](bool single) {
      return Exported(export_c(model, one.control, one.estimator, {.single_precision = single}),
                      {horizon < 20 ? "-O0" : "-O1"});
    };
    const ReplayDifference in_double = replay(exported(false), recorded);
    expect_within(in_double, kDouble);
    const ReplayDifference in_single = replay(exported(true), recorded);
    const Across across = decisions_of(one);
    expect_within(in_single, across.bars);
    EXPECT_LE(in_single.beyond, across.share * in_single.cycles);
    std::cout << fmt::format(
        "N = {}, {}: double {:.1e} W, {:.1e} K; single {:.1e} W, {:.1e} K, {} of {} beyond\n",
        horizon, one.name, in_double.power, in_double.peak, in_single.power, in_single.peak,
        in_single.beyond, in_single.cycles);
    for (std::size_t n = 1; n < recorded.size(); ++n) {
      limited += recorded[n].limited ? 1 : 0;
      changed += recorded[n].limited != recorded[n - 1].limited ? 1 : 0;
    }
    all += static_cast<int>(recorded.size());
  }
  EXPECT_GE(all, kCyclesPerHorizon);
  EXPECT_GT(limited, all / 5);
  EXPECT_GT(changed, all / changes_one_in);
}

TEST_P(Replay, PowersAreThoseOfTheLibrary) {
  powers_are_those_of_the_library(
      GetParam(), replay_cases(GetParam()),
      [](const ReplayCase& one) { return model_for(one.control.period); }, 10);
}

TEST_P(Replay, PowersWithinAProbabilityAreThoseOfTheLibrary) {
  powers_are_those_of_the_library(GetParam(), chance_cases(GetParam()), chance_model, 20);
}

TEST(ReplayGuard, AnotherControllersPowersAreSeen) {
  const ReplayCase one = replay_cases(5)[4];
  ReplayCase other = one;
  other.estimator.measurement_noise *= 1.0 + 1e-6;
  const std::vector<ReplayCycle> recorded = record(model_for(1e-3), one, 500, 18);
  const Exported exported(export_c(model_for(1e-3), other.control, other.estimator, {}));
  EXPECT_GT(replay(exported, recorded).power, kDouble.power);
}

TEST(ReplayGuard, AnotherProbabilitysPowersAreSeen) {
  const ReplayCase one = chance_cases(5)[0];
  ReplayCase other = one;
  other.control.limit_probability *= 1.0 + 1e-6;
  const ReducedModel model = chance_model(one);
  const std::vector<ReplayCycle> recorded = record(model, one, 500, 18);
  const Exported exported(export_c(model, other.control, other.estimator, {}));
  EXPECT_GT(replay(exported, recorded).power, kDouble.power);
}

INSTANTIATE_TEST_SUITE_P(Horizons, Replay, ::testing::Values(2, 5, 10, 20),
                         [](const auto& one) { return "N" + std::to_string(one.param); });

}  // namespace
}  // namespace photocoag::testing
