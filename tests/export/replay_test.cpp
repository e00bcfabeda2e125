// The exported controller gives the powers of the C++ one, cycle by cycle, in both precisions.
#include <gtest/gtest.h>

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

// 1e-12 W and 1e-9 K: rounding, with the condition of the longest horizon. 1e-5 W of 0.06 W and
// 1e-3 K of 30 K: single precision.
constexpr ReplayDifference kDouble{.power = 1e-12, .peak = 1e-9};
constexpr ReplayDifference kSingle{.power = 1e-5, .peak = 1e-3};
// The margin of "certified" steps where the estimated alpha passes a node of the certificate:
// single precision may be on the other side for some periods. A step is some 0.01 K of the limit.
constexpr double kSingleAcrossAStep = 1e-4;

void expect_within(const ReplayDifference& difference, const ReplayDifference& bars) {
  EXPECT_LE(difference.power, bars.power) << "in cycle " << difference.worst;
  EXPECT_LE(difference.peak, bars.peak);
}

TEST_P(Replay, PowersAreThoseOfTheLibrary) {
  const std::vector<ReplayCase> cases = replay_cases(GetParam());
  const int cycles = kCyclesPerHorizon / static_cast<int>(cases.size()) + 1;
  int limited = 0;
  int changed = 0;
  int all = 0;
  for (const ReplayCase& one : cases) {
    SCOPED_TRACE(one.name);
    const ReducedModel& model = model_for(one.control.period);
    const std::vector<ReplayCycle> recorded = record(model, one, cycles, 18);
    const auto exported = [&](bool single) {
      return Exported(export_c(model, one.control, one.estimator, {.single_precision = single}),
                      {GetParam() < 20 ? "-O0" : "-O1"});
    };
    expect_within(replay(exported(false), recorded), kDouble);
    ReplayDifference bars = kSingle;
    if (one.control.robust == Robustness::kCertified) bars.power = kSingleAcrossAStep;
    expect_within(replay(exported(true), recorded), bars);
    for (std::size_t n = 1; n < recorded.size(); ++n) {
      limited += recorded[n].limited ? 1 : 0;
      changed += recorded[n].limited != recorded[n - 1].limited ? 1 : 0;
    }
    all += static_cast<int>(recorded.size());
  }
  EXPECT_GE(all, kCyclesPerHorizon);
  EXPECT_GT(limited, all / 5);
  EXPECT_GT(changed, all / 10);
}

TEST(ReplayGuard, AnotherControllersPowersAreSeen) {
  const ReplayCase one = replay_cases(5)[4];
  ReplayCase other = one;
  other.estimator.measurement_noise *= 1.0 + 1e-6;
  const std::vector<ReplayCycle> recorded = record(model_for(1e-3), one, 500, 18);
  const Exported exported(export_c(model_for(1e-3), other.control, other.estimator, {}));
  EXPECT_GT(replay(exported, recorded).power, kDouble.power);
}

INSTANTIATE_TEST_SUITE_P(Horizons, Replay, ::testing::Values(2, 5, 10, 20));

}  // namespace
}  // namespace photocoag::testing
