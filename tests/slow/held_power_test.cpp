// A million control periods in virtual time with overruns at random: the device holds a power for a
// second period, goes dark, and is lit again. Whatever comes when, the limit holds.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <vector>

#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kCycles = 250;
constexpr int kTreatments = 4000;

/// Wakes the loop late at random, for up to four periods: one overrun alone or a busy spell.
class BusyMachine : public VirtualPace {
 public:
  BusyMachine(double period, std::uint64_t treatment, double chance)
      : VirtualPace(period), treatment_(treatment), chance_(chance) {}
  std::size_t wait_for_end_of(std::size_t cycle) noexcept {
    const std::uint64_t draw = treatment_ * 1000 + cycle;
    const double lot = uniform(5, draw, RandomStream::kTest);
    if (lot >= chance_) return 0;
    return 1 + static_cast<std::size_t>(4.0 * lot / chance_);
  }

 private:
  std::uint64_t treatment_;
  double chance_;
};

struct Rate {
  Config config;
  ModelStore models;
  ObserverModel observer;
  explicit Rate(double period_ms)
      : config(load_config("", {fmt::format("control.period_ms={}", period_ms)})),
        models(config, true),
        observer(observer_model(config)) {}
};

struct Peaks {
  double highest = 0.0;  // K
  double missed = 0.0;   // overruns
  int over = 0;          // treatments
};

Peaks treat_on_a_busy_machine(bool held_power_is_checked, int treatments) {
  Peaks peaks;
  Rate rates[] = {Rate(1.0), Rate(4.0)};
  std::vector<CycleRecord> records(kCycles);
  for (int i = 0; i < treatments; ++i) {
    const auto draw = static_cast<std::uint64_t>(i);
    Rate& rate = rates[i % 2];
    Config config = rate.config;
    config.plant.absorption_factor = 0.35 + 1.15 * uniform(6, draw, RandomStream::kTest);
    config.control.horizon = i % 4 < 2 ? 5 : 2;
    config.control.delay = i % 8 < 4 ? 0 : 1;
    const double period = config.control.period;
    SimulatedEye device(FullOrderPlant(rate.models.plant_full(), config.plant.discretization,
                                       period, config.plant.absorption()),
                        config.plant.noise, draw + 1, {.delay = config.control.delay},
                        BusyMachine(period, draw, i % 3 == 0 ? 0.03 : 0.3));
    SafetyLimits limits = safety_limits(config);
    limits.command_held = held_power_is_checked ? 1 : 0;
    Supervisor supervisor(limits, rate.observer);
    supervisor.power_on();
    supervisor.finish_self_test(passed_self_test(limits.noise));
    supervisor.ready();
    supervisor.begin(true);
    Controller controller(rate.models.reduced(), config.control, config.estimator);
    const LoopOutcome outcome =
        run_loop(controller, device, supervisor, period, std::span(records));
    EXPECT_FALSE(outcome.stopped) << i << ' ' << to_string(outcome.safety.reason);
    double highest = 0.0;
    for (std::size_t k = 0; k < outcome.cycles; ++k) {
      highest = std::max(highest, records[k].truth.peak);
    }
    peaks.missed += static_cast<double>(outcome.overruns);
    peaks.highest = std::max(peaks.highest, highest);
    peaks.over += highest > config.control.peak_max ? 1 : 0;
  }
  return peaks;
}

TEST(HeldPower, NoOverrunOfAMillionPeriodsOverheats) {
  const Peaks peaks = treat_on_a_busy_machine(true, kTreatments);
  EXPECT_LT(peaks.highest, 31.67) << "docs/safety.md names it";
  EXPECT_GT(peaks.missed, 100'000.0) << "what is tested has to happen";
}

TEST(HeldPower, WithoutTheCheckItDoes) { EXPECT_GT(treat_on_a_busy_machine(false, 100).over, 0); }

}  // namespace
}  // namespace photocoag
