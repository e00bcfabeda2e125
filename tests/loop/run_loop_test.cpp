// The simulated eye and the loop around it: noise, watchdog, missed periods, stop.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <vector>

#include "estimation/test_models.hpp"
#include "loop/treatments.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/observer.hpp"

namespace photocoag::testing {
namespace {

using Eye = SimulatedEye<ReducedPlant>;

Eye make_eye(double noise = 0.288, std::uint64_t seed = 1, double alpha = 1.1) {
  return Eye(ReducedPlant(model_1khz(), alpha), noise, seed);
}

/// A clock that only moves when the loop waits: the wake-up that ends cycle k comes late by late[k]
/// periods.
class FakeClock : public VirtualPace {
 public:
  explicit FakeClock(std::vector<double> late, std::size_t stop_at = SIZE_MAX)
      : VirtualPace(1e-3), late_(std::move(late)), stop_at_(stop_at) {
    asked.reserve(1000);
  }

  std::size_t wait_for_end_of(std::size_t cycle) noexcept {
    asked.push_back(cycle);
    const double deadline = static_cast<double>(cycle + 1);
    now_ = std::max(now_, deadline) + (cycle < late_.size() ? late_[cycle] : 0.0);
    const double behind = now_ - deadline;
    if (cycle >= stop_at_) *stop = true;
    return static_cast<std::size_t>(behind);
  }

  std::vector<std::size_t> asked;
  std::atomic<bool>* stop = nullptr;

 private:
  std::vector<double> late_;
  std::size_t stop_at_;
  double now_ = 0.0;
};
static_assert(Pace<FakeClock>);

template <Pace C>
struct Heard : SimulatedEye<ReducedPlant, C> {
  using SimulatedEye<ReducedPlant, C>::SimulatedEye;
  void heartbeat(std::uint64_t cycle) noexcept { last_heartbeat = cycle; }
  std::uint64_t last_heartbeat = UINT64_MAX;
};

struct StopSeen : TreatmentObserver {
  using TreatmentObserver::TreatmentObserver;
  void finished(const CycleRecord& record, const CycleEnd& end) noexcept {
    asked = asked || end.sample.stop_asked;
    TreatmentObserver::finished(record, end);
  }
  bool asked = false;
};

/// What an update made of its sample, as the log gets it.
struct InnovationsSeen : TreatmentObserver {
  using TreatmentObserver::TreatmentObserver;
  void finished(const CycleRecord& record, const CycleEnd& end) noexcept {
    const bool updated = record.estimate.status == UpdateStatus::kUpdated;
    sigmas.push_back(end.innovation_sigma);
    without_sigma += updated == std::isfinite(end.innovation_sigma) ? 0 : 1;
    if (updated) {
      const double ratio = (record.measured - end.volume_predicted) / end.innovation_sigma;
      squares += ratio * ratio;
      ++updates;
    }
    TreatmentObserver::finished(record, end);
  }
  std::vector<double> sigmas;
  double squares = 0.0;
  int updates = 0;
  int without_sigma = 0;
};

struct LoopRun {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  std::size_t progress = 0;
  double power_afterwards = -1.0;  ///< what the laser emits in the period after the loop
  std::uint64_t last_heartbeat = 0;
  bool stop_recorded = false;
};

template <Pace C>
LoopRun run(C& pace, std::size_t cycles, bool stopped = false) {
  LoopRun result;
  result.records.resize(cycles);
  Controller controller(model_1khz(), {}, {});
  std::atomic<bool> stop{stopped};
  std::atomic<std::size_t> progress{0};
  if constexpr (requires { pace.stop; }) pace.stop = &stop;
  Heard<C> device(ReducedPlant(model_1khz(), 1.1), 0.288, 1, EyeSettings{}, pace);
  StopSeen observer(1e-3, 0, {.stop = &stop, .progress = &progress});
  Unsupervised none;
  result.outcome = run_loop(controller, device, none, 1e-3, std::span(result.records), observer);
  pace = device.pace();
  result.last_heartbeat = device.last_heartbeat;
  result.stop_recorded = observer.asked;
  result.progress = progress.load();
  result.records.resize(result.outcome.cycles);
  result.power_afterwards = device.advance(cycles).sample.applied_power;
  return result;
}

LoopRun run_virtual(std::size_t cycles) {
  VirtualPace pace(1e-3);
  return run(pace, cycles);
}

TEST(SimulatedEye, NoiseDependsOnSeedAndCycleAlone) {
  // Read in another order, on another plant, with other powers: the same noise at the same cycle.
  Eye forward = make_eye(0.5, 9);
  Eye backward = make_eye(0.5, 9, 0.4);
  std::vector<double> noise;
  for (std::uint64_t k = 0; k < 100; ++k) {
    forward.write(0.03);
    const Reading reading = forward.advance(k);
    noise.push_back(reading.sample.volume_temperature - reading.truth.volume);
  }
  for (std::uint64_t k = 100; k-- > 0;) {
    backward.write(0.05);
    const Reading reading = backward.advance(k);
    // The noise is seen after a rounded sum of some 10 K.
    ASSERT_NEAR(reading.sample.volume_temperature - reading.truth.volume, noise[k], 1e-13);
  }
  Eye other = make_eye(0.5, 10);
  other.write(0.03);
  const Reading reading = other.advance(0);
  EXPECT_NE(reading.sample.volume_temperature - reading.truth.volume, noise[0]);
}

TEST(SimulatedEye, NoiseHasTheGivenStandardDeviation) {
  Eye eye = make_eye(0.288, 3);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kCount = 20000;
  for (int k = 0; k < kCount; ++k) {
    const Reading reading = eye.advance(static_cast<std::uint64_t>(k));
    const double noise = reading.sample.volume_temperature - reading.truth.volume;
    sum += noise;
    squares += noise * noise;
  }
  // Five standard deviations of mean and variance of 20,000 normal numbers.
  EXPECT_NEAR(sum / kCount, 0.0, 5 * 0.288 / std::sqrt(kCount));
  EXPECT_NEAR(squares / kCount / (0.288 * 0.288), 1.0, 5 * std::sqrt(2.0 / kCount));
}

TEST(SimulatedEye, WatchdogHoldsOnePeriodThenEmitsNothing) {
  Eye eye = make_eye();
  EXPECT_EQ(eye.advance(0).sample.applied_power, 0.0) << "no command yet: no light";
  eye.write(0.05);
  EXPECT_EQ(eye.advance(1).sample.applied_power, 0.05);
  EXPECT_EQ(eye.advance(2).sample.applied_power, 0.05) << "held for one more period";
  for (std::uint64_t k = 3; k < 10; ++k) EXPECT_EQ(eye.advance(k).sample.applied_power, 0.0);
  eye.write(0.02);
  EXPECT_EQ(eye.advance(10).sample.applied_power, 0.02) << "a fresh command counts again";
}

TEST(SimulatedEye, AnOffsetIsInEverySampleAndInNothingElse) {
  const auto make = [](double offset) {
    return Eye(ReducedPlant(model_1khz(), 1.1), 0.288, 5,
               {.dark_is_silent = true, .sensor_gain = 0.9, .sensor_offset = offset});
  };
  Eye shifted = make(2.0);
  Eye right = make(0.0);
  for (std::uint64_t k = 0; k < 20; ++k) {
    const double power = k == 7 ? 0.0 : 0.03;
    shifted.write(power);
    right.write(power);
    const Reading seen = shifted.advance(k);
    const Reading wanted = right.advance(k);
    EXPECT_EQ(seen.truth.peak, wanted.truth.peak);
    EXPECT_EQ(seen.truth.volume, wanted.truth.volume);
    EXPECT_EQ(seen.sample.applied_power, wanted.sample.applied_power);
    if (power == 0.0) {
      EXPECT_TRUE(std::isnan(seen.sample.volume_temperature)) << "no sample, no offset";
    } else {
      // Rounding of sums of some 40 K.
      EXPECT_NEAR(seen.sample.volume_temperature - wanted.sample.volume_temperature, 2.0, 1e-13);
    }
  }
}

TEST(RunLoop, OnTimeTheClockChangesNothing) {
  // Late by less than a period is not a missed period.
  FakeClock clock(std::vector<double>(250, 0.999));
  const LoopRun paced = run(clock, 250);
  const LoopRun virtual_time = run_virtual(250);
  EXPECT_TRUE(same(paced.records, virtual_time.records));
  EXPECT_EQ(paced.outcome.overruns, 0u);
  EXPECT_EQ(paced.last_heartbeat, 249u);
}

TEST(RunLoop, RecordsAreCompleteAndRepeatBitForBit) {
  const LoopRun one = run_virtual(250);
  ASSERT_EQ(one.outcome.cycles, 250u);
  EXPECT_FALSE(one.outcome.stopped);
  EXPECT_EQ(one.progress, 250u);
  EXPECT_EQ(one.power_afterwards, 0.0) << "the last write must be 0 W";
  for (std::size_t k = 0; k < 250; ++k) {
    const CycleRecord& r = one.records[k];
    ASSERT_EQ(r.cycle, static_cast<std::int64_t>(k));
    ASSERT_EQ(r.time, static_cast<double>(k + 1) * 1e-3);
    ASSERT_EQ(r.power, r.decision.power) << "applied is what was decided for this cycle";
    ASSERT_EQ(r.estimate.status, UpdateStatus::kUpdated);
    ASSERT_FALSE(r.overrun);
  }
  EXPECT_TRUE(same(one.records, run_virtual(250).records));
}

// Of a filter that is right the squares of innovation / sigma have the mean 1.
TEST(RunLoop, TheInnovationsSigmaIsThatOfItsSample) {
  constexpr std::size_t kCycles = 400;
  std::vector<CycleRecord> records(kCycles);
  EstimatorSettings right;
  right.power_process_noise = 0.0;  // the eye is the model
  Controller controller(model_1khz(), {}, right);
  std::vector<double> late(kCycles, 0.0);
  late[20] = 2.5;  // two periods without a sample
  SimulatedEye<ReducedPlant, FakeClock> eye(ReducedPlant(model_1khz(), 1.1), 0.288, 1, {},
                                            FakeClock(late));
  InnovationsSeen observer(1e-3, 0, {});
  Unsupervised none;
  run_loop(controller, eye, none, 1e-3, std::span(records), observer);
  EXPECT_EQ(observer.without_sigma, 0) << "NaN exactly where there was no update";
  EXPECT_EQ(observer.updates, static_cast<int>(kCycles) - 2);
  // Mean of n squares of standard normals: sqrt(2 / n) = 0.07 off; four of it.
  EXPECT_NEAR(observer.squares / observer.updates, 1.0, 0.28);
}

/// An eye with one sample that cannot be.
struct SpikedEye : SimulatedEye<ReducedPlant, FakeClock> {
  using SimulatedEye::SimulatedEye;
  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    DeviceSample sample = SimulatedEye::wait_sample(cycle);
    if (cycle == 50) sample.volume_temperature += 40.0;
    return sample;
  }
};

/// The same powers and samples to a filter outside of the loop: each cycle's sigma is its own.
template <typename Filter>
void expect_sigmas_of(EstimatorKind kind) {
  SCOPED_TRACE(static_cast<int>(kind));
  constexpr std::size_t kCycles = 100;
  const EstimatorSettings settings{.kind = kind, .outlier_sigma = 6.0};
  std::vector<CycleRecord> records(kCycles);
  Controller controller(model_1khz(), {}, settings);
  std::vector<double> late(kCycles, 0.0);
  late[20] = 2.5;
  SpikedEye eye(ReducedPlant(model_1khz(), 1.1), 0.288, 1, {}, FakeClock(late));
  InnovationsSeen observer(1e-3, 0, {});
  Unsupervised none;
  run_loop(controller, eye, none, 1e-3, std::span(records), observer);
  EXPECT_EQ(records[50].estimate.status, UpdateStatus::kOutlier);
  EXPECT_EQ(observer.without_sigma, 0) << "NaN exactly where there was no update";
  Filter filter(model_1khz(), settings);
  ASSERT_EQ(observer.sigmas.size(), kCycles);
  for (std::size_t k = 0; k < kCycles; ++k) {
    filter.predict(records[k].power);
    ASSERT_EQ(filter.update(records[k].measured), records[k].estimate.status) << k;
    if (records[k].estimate.status != UpdateStatus::kUpdated) continue;
    EXPECT_EQ(observer.sigmas[k], filter.innovation_sigma()) << k;
  }
}

TEST(RunLoop, TheInnovationsSigmaIsThatOfItsOwnCycle) {
  expect_sigmas_of<ExtendedKalmanFilter>(EstimatorKind::kEkf);
  expect_sigmas_of<MovingHorizonEstimator>(EstimatorKind::kMhe);
}

TEST(RunLoop, MissedPeriodsAreSkippedRecordedAndKeepThePhase) {
  // The wake-up of cycle 20 comes 3.4 periods late: cycles 21 to 23 have passed as well.
  std::vector<double> late(100, 0.0);
  late[20] = 3.4;
  FakeClock clock(late);
  const LoopRun result = run(clock, 60);
  const LoopRun undisturbed = run_virtual(60);
  EXPECT_EQ(result.outcome.cycles, 60u);
  EXPECT_EQ(result.outcome.overruns, 3u);
  for (std::size_t k = 0; k < 20; ++k) {
    ASSERT_TRUE(same(result.records[k], undisturbed.records[k]));
  }
  const auto& r = result.records;
  const double command = r[20].decision.power;
  EXPECT_GT(command, 0.0);
  // The laser: the command, held once, then the watchdog.
  EXPECT_EQ(r[20].power, command);
  EXPECT_EQ(r[21].power, command);
  EXPECT_EQ(r[22].power, 0.0);
  EXPECT_EQ(r[23].power, 0.0);
  EXPECT_EQ(r[24].power, r[24].decision.power);
  // Only the period that has just ended has a fresh sample.
  for (const std::size_t k : {20u, 21u, 22u}) {
    EXPECT_TRUE(std::isnan(r[k].measured)) << k;
    EXPECT_EQ(r[k].estimate.status, UpdateStatus::kNoSample) << k;
  }
  EXPECT_TRUE(std::isfinite(r[23].measured));
  EXPECT_EQ(r[23].estimate.status, UpdateStatus::kUpdated);
  // The estimator knew what the laser really did: it is as right as before.
  EXPECT_NEAR(r[23].estimate.outputs.peak, r[23].truth.peak, 4 * r[23].estimate.peak_sigma + 0.05);
  for (std::size_t k = 0; k < 60; ++k) {
    EXPECT_EQ(r[k].overrun, k >= 21 && k <= 23) << k;
    ASSERT_EQ(r[k].cycle, static_cast<std::int64_t>(k)) << "no cycle is lost";
    ASSERT_EQ(r[k].time, static_cast<double>(k + 1) * 1e-3) << "the grid does not move";
  }
  // After the gap the loop waits for the end of cycle 24, not for "now + T".
  ASSERT_GT(clock.asked.size(), 21u);
  EXPECT_EQ(clock.asked[20], 20u);
  EXPECT_EQ(clock.asked[21], 24u);
}

TEST(RunLoop, AMissBeyondTheEndStaysInsideTheRecords) {
  struct Miss {
    std::size_t at;
    double late;
  };
  // Late at the last wake-up: the power written before is still held.
  for (const Miss miss : {Miss{57, 1.0}, Miss{57, 5.0}, Miss{57, 1e6}, Miss{59, 1.0}}) {
    std::vector<double> lateness(60, 0.0);
    lateness[miss.at] = miss.late;
    FakeClock clock(lateness);
    const LoopRun result = run(clock, 60);
    EXPECT_EQ(result.outcome.cycles, 60u);
    EXPECT_EQ(result.records.back().cycle, 59);
    EXPECT_EQ(result.power_afterwards, 0.0);
  }
}

TEST(RunLoop, AStopRequestEndsWithAPeriodAtZero) {
  for (const std::size_t stop_at : {0u, 1u, 30u, 58u}) {
    FakeClock clock({}, stop_at);
    const LoopRun result = run(clock, 60);
    EXPECT_TRUE(result.outcome.stopped) << stop_at;
    ASSERT_EQ(result.outcome.cycles, stop_at + 2) << "the cycle that was running, and one at 0 W";
    EXPECT_EQ(result.progress, stop_at + 2);
    const CycleRecord& last = result.records.back();
    EXPECT_EQ(last.power, 0.0);
    EXPECT_EQ(last.decision.status, MpcStatus::kStopped);
    EXPECT_EQ(last.estimate.status, UpdateStatus::kUpdated) << "it is still watched";
    EXPECT_GT(result.records[stop_at].power, 0.0);
    EXPECT_EQ(result.power_afterwards, 0.0);
    EXPECT_EQ(result.last_heartbeat, stop_at + 1);
  }
}

TEST(RunLoop, AStopInTheLastCycleIsTheOrdinaryEnd) {
  FakeClock clock({}, 59);
  const LoopRun result = run(clock, 60);
  EXPECT_EQ(result.outcome.cycles, 60u);
  EXPECT_FALSE(result.outcome.stopped);
  EXPECT_EQ(result.power_afterwards, 0.0);
}

TEST(RunLoop, AStopDuringMissedPeriodsStillEndsAtZero) {
  std::vector<double> late(60, 0.0);
  late[20] = 2.5;
  FakeClock clock(late, 20);
  const LoopRun result = run(clock, 60);
  EXPECT_TRUE(result.outcome.stopped);
  EXPECT_EQ(result.outcome.cycles, 24u);
  EXPECT_EQ(result.records.back().power, 0.0);
  EXPECT_EQ(result.power_afterwards, 0.0);
}

TEST(RunLoop, StopFlagOfVirtualTimeIsSeenAtOnce) {
  VirtualPace pace(1e-3);
  const LoopRun result = run(pace, 60, true);
  EXPECT_TRUE(result.outcome.stopped);
  EXPECT_TRUE(result.stop_recorded) << "the log says why";
  EXPECT_EQ(result.outcome.cycles, 2u);
  EXPECT_EQ(result.records.back().power, 0.0);
}

TEST(RunLoop, WithoutRecordsThereIsNoLight) {
  FakeClock clock({});
  const LoopRun result = run(clock, 0);
  EXPECT_EQ(result.outcome.cycles, 0u);
  EXPECT_EQ(result.power_afterwards, 0.0);
  EXPECT_TRUE(clock.asked.empty());
}

}  // namespace
}  // namespace photocoag::testing
