// Laser, tissue and transducer: watchdog, measurement, and every fault as the controller sees it.
#include "photocoag/eye/pulsed_eye.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "photocoag/core/files.hpp"
#include "photocoag/photoacoustics/thermometer.hpp"
#include "support/heap_guard.hpp"
#include "support/reduced_models.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

constexpr int kPulses = 10;  // per control period
constexpr std::int64_t kPulseNs = 100'000;

/// An eye with a controller that writes the same power each period.
struct Bench {
  explicit Bench(PulsedEyeSettings settings = {})
      : eye(coarse_full_model(), 1.1, GrueneisenCurve(water_like_curve()), settings, script) {
    orders.pulses_per_period = kPulses;
  }
  PulseRecord next() {
    PulseRecord record;
    eye.fire(number, static_cast<std::int64_t>(number) * kPulseNs, orders, record);
    truth = eye.settle();
    ++number;
    orders.take = false;
    return record;
  }
  void write(double power) {
    orders.power = power;
    orders.take = true;
    ++orders.tokens;
  }
  /// One control period with a fresh command at its start.
  std::vector<PulseRecord> period(double power) {
    write(power);
    std::vector<PulseRecord> records;
    for (int i = 0; i < kPulses; ++i) records.push_back(next());
    return records;
  }
  void begin() { orders.begin = number / kPulses; }

  FaultScript script;
  PulsedEye eye;
  EyeOrders orders;
  std::uint64_t number = 0;
  PulseTruth truth;
};

TEST(PulsedEye, WithoutANewTokenForTwoPeriodsItIsDark) {
  Bench bench;
  bench.period(0.03);
  bench.write(0.03);
  for (int i = 0; i < 2 * kPulses; ++i) EXPECT_EQ(bench.next().power_readback, 0.03) << i;
  for (int i = 0; i < 50; ++i) EXPECT_EQ(bench.next().power_readback, 0.0) << i;
  bench.write(0.03);
  EXPECT_EQ(bench.next().power_readback, 0.03);
  // A token alone, with a command for later, keeps the power.
  for (int i = 0; i < 3 * kPulses; ++i) {
    if (i % kPulses == 0) ++bench.orders.tokens;
    EXPECT_EQ(bench.next().power_readback, 0.03);
  }
}

TEST(PulsedEye, OnlyPowersOfSuchALaserAreTaken) {
  for (const double power : {-1e-3, 1.01, std::nan(""), HUGE_VAL}) {
    Bench bench;
    bench.period(0.03);
    bench.write(power);
    EXPECT_EQ(bench.next().power_readback, 0.0) << power;
  }
}

TEST(PulsedEye, SafeOffOpensTheInterlockForThisController) {
  Bench bench;
  bench.period(0.03);
  bench.orders.safe_off = true;
  bench.write(0.03);
  const PulseRecord record = bench.next();
  EXPECT_EQ(record.power_readback, 0.0);
  EXPECT_NE(record.flags & kEyeInterlock, 0u);
  bench.orders.safe_off = false;
  bench.write(0.03);
  EXPECT_EQ(bench.next().power_readback, 0.0);
  bench.eye.attach();
  bench.write(0.03);
  EXPECT_EQ(bench.next().power_readback, 0.03);
}

TEST(PulsedEye, ItsSamplesHaveThePapersNoiseAndNoBias) {
  Bench bench;
  std::vector<PulseReading> cold;
  for (int i = 0; i < 2000; ++i) cold.push_back(bench.next().reading);
  const GrueneisenCurve curve(water_like_curve());
  const ThermometerSettings settings;
  const Baseline baseline = measure_baseline(cold, settings);
  PulseThermometer thermometer(baseline, curve, settings);
  // Warm up, then hold: the drift within a period is far below the noise.
  for (int i = 0; i < 300; ++i) bench.period(0.025);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kSamples = 1000;
  for (int k = 0; k < kSamples; ++k) {
    double heard = 0.0;
    bench.write(0.025);
    for (int i = 0; i < kPulses; ++i) {
      heard += bench.eye.volume_before() / kPulses;
      thermometer.add(bench.next().reading);
    }
    const double error = thermometer.finish().volume_temperature - heard;
    sum += error;
    squares += error * error;
  }
  const double mean = sum / kSamples;
  // 0.02 K from the baseline's 2000 pulses, times Gamma(T)/Gamma(T_0) = 1.7; 0.01 K from here.
  EXPECT_LT(std::abs(mean), 0.1);
  EXPECT_NEAR(std::sqrt(squares / kSamples - mean * mean), 0.288, 0.0288);
}

TEST(PulsedEye, InTheDarkASingleLaserIsSilent) {
  for (const bool silent : {false, true}) {
    Bench bench({.dark_is_silent = silent});
    EXPECT_GT(bench.next().reading.energy, 0.0) << "before a treatment there are probe pulses";
    while (bench.number % kPulses != 0) bench.next();
    bench.begin();
    const std::vector<PulseRecord> records = bench.period(0.0);
    EXPECT_EQ(records[0].reading.energy > 0.0, !silent);
    EXPECT_EQ((records[0].flags & kEyeSilent) != 0, silent);
    EXPECT_EQ(bench.truth.peak_mean, 0.0) << "a probe's heat is not counted";
  }
}

// Below 0.05 uJ the thermometer leaves a pulse out; the second laser's does for it.
TEST(PulsedEye, APulseTooWeakToMeasureByIsProbed) {
  const ThermometerSettings thermometer;
  for (const double power : {1e-12, 1e-6, 4e-4, 6e-4, 2e-3}) {
    for (const bool silent : {false, true}) {
      Bench bench({.dark_is_silent = silent});
      bench.begin();
      const PulseRecord record = bench.period(power).back();
      EXPECT_EQ(record.power_readback, power) << "what heats";
      const double own = power * 1e-9 * kPulseNs;
      if (silent || power == 2e-3) {
        EXPECT_NEAR(record.reading.energy, own, 0.1 * own);
      } else {
        EXPECT_GT(record.reading.energy, 10 * thermometer.energy_min) << power;
      }
    }
  }
}

TEST(PulsedEye, NothingIsAllocatedPerPulse) {
  Bench bench;
  bench.write(0.03);
  PulseRecord record;
  const HeapGuard guard;
  bench.eye.fire(0, 0, bench.orders, record);
  const PulseTruth truth = bench.eye.settle();
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
  EXPECT_GT(truth.peak_pulse, 0.0);
}

// Each fault, injected at cycle 2, as seen there and not before.
void expect_fault(const std::string& text,
                  const std::function<void(const std::vector<PulseRecord>& good,
                                           const std::vector<PulseRecord>& bad, Bench&)>& judge) {
  SCOPED_TRACE(text);
  Bench bench;
  ASSERT_TRUE(bench.script.add(parse_fault(text, "test")));
  for (int k = 0; k < 5; ++k) bench.period(0.02);  // not a treatment yet: no fault
  bench.begin();
  bench.period(0.02);
  const std::vector<PulseRecord> good = bench.period(0.02);
  const std::vector<PulseRecord> bad = bench.period(0.02);
  for (const PulseRecord& record : good) {
    EXPECT_EQ(record.flags, 0u);
    EXPECT_EQ(record.power_readback, 0.02);
    EXPECT_GT(record.reading.energy, 0.0);
  }
  judge(good, bad, bench);
}

TEST(PulsedEyeFaults, EachIdDoesWhatTheTableSays) {
  using Records = std::vector<PulseRecord>;
  const auto silent = [](const Records& records) {
    return (records[0].flags & kEyeSilent) != 0 && records[0].reading.energy == 0.0;
  };
  expect_fault("M1@2", [&](const Records&, const Records& bad, Bench& bench) {
    EXPECT_TRUE(silent(bad));
    EXPECT_FALSE(silent(bench.period(0.02)));
  });
  expect_fault("M2@2", [&](const Records&, const Records& bad, Bench& bench) {
    EXPECT_TRUE(silent(bad) && silent(bench.period(0.02)) && silent(bench.period(0.02)));
    EXPECT_FALSE(silent(bench.period(0.02)));
  });
  expect_fault("M3@2", [](const Records& good, const Records& bad, Bench&) {
    EXPECT_EQ(bad[9].time_ns, good[9].time_ns - kPulses * kPulseNs);
  });
  expect_fault("M4@2", [](const Records& good, const Records& bad, Bench&) {
    EXPECT_EQ(bad[0].reading.transient, good[9].reading.transient);
    EXPECT_EQ(bad[9].reading.transient, good[9].reading.transient);
  });
  expect_fault("M5@2", [](const Records&, const Records& bad, Bench&) {
    EXPECT_TRUE(std::isnan(bad[0].reading.energy));
  });
  expect_fault("M6@2", [](const Records&, const Records& bad, Bench&) {
    EXPECT_EQ(bad[0].reading.transient.codes[50], kConverterRail);
  });
  expect_fault("M7@2*25", [](const Records& good, const Records& bad, Bench&) {
    const auto largest = [](const PulseRecord& record) {
      int most = 0;
      for (const auto code : record.reading.transient.codes) most = std::max<int>(most, code);
      return most;
    };
    EXPECT_GT(largest(bad[0]), 1.4 * largest(good[0]));
  });
  expect_fault("M8@2*10", [](const Records& good, const Records& bad, Bench&) {
    const auto quiet = [](const PulseRecord& record) {
      double squares = 0.0;
      for (int i = 0; i < 24; ++i) {
        squares += std::pow(record.reading.transient.codes[static_cast<std::size_t>(i)], 2);
      }
      return squares;
    };
    EXPECT_GT(quiet(bad[0]), 20.0 * quiet(good[0]));
  });
  expect_fault("M9@2", [](const Records& good, const Records& bad, Bench&) {
    EXPECT_GT(bad[0].time_ns, good[0].time_ns + 3'599'000'000'000);
  });
  expect_fault("A1@2", [](const Records&, const Records& bad, Bench& bench) {
    EXPECT_DOUBLE_EQ(bad[0].power_readback, 0.03);
    EXPECT_GT(bench.truth.peak_mean, 1.0);
  });
  expect_fault("A2@2*0.05", [](const Records&, const Records& bad, Bench& bench) {
    EXPECT_EQ(bad[0].power_readback, 0.05);
    EXPECT_EQ(bench.period(0.0)[0].power_readback, 0.05) << "stuck on";
    bench.orders.safe_off = true;
    EXPECT_EQ(bench.period(0.0)[0].power_readback, 0.0) << "but the interlock is a real one";
  });
  expect_fault("A3@2", [](const Records&, const Records& bad, Bench& bench) {
    EXPECT_EQ(bad[9].power_readback, 0.02) << "held by the last token";
    EXPECT_EQ(bench.period(0.02)[0].power_readback, 0.0) << "the watchdog";
  });
  expect_fault("A4@2", [](const Records&, const Records&, Bench& bench) {
    EXPECT_TRUE(bench.eye.vanished());
  });
  for (const auto& [text, flag] :
       {std::pair{"A5@2", kEyeShutter}, std::pair{"A5@2*1", kEyeInterlock},
        std::pair{"A5@2*2", kEyeFootSwitch}}) {
    expect_fault(text, [flag = flag](const Records&, const Records& bad, Bench& bench) {
      EXPECT_EQ(bad[0].flags, flag);
      EXPECT_EQ(bad[0].power_readback, 0.0);
      const double peak = bench.truth.peak_mean;
      bench.period(0.02);
      EXPECT_LT(bench.truth.peak_mean, peak) << "no light gets through";
    });
  }
  expect_fault("T1@2*3", [](const Records&, const Records&, Bench& bench) {
    EXPECT_EQ(bench.eye.late_ms(), 0.0) << "once per period";
  });
}

TEST(FaultScript, TextAndFiles) {
  const ScriptedFault fault = parse_fault("M8@120+7*2.5", "test");
  EXPECT_EQ(fault.fault, EyeFault::kNoise);
  EXPECT_EQ(fault.start, 120u);
  EXPECT_EQ(fault.count, 7u);
  EXPECT_EQ(fault.value, 2.5);
  for (const std::string bad : {"", "M2", "M2@", "M2@x", "M2@-1", "X9@3", "M2@3+0", "M2@3*nan",
                                "M2@3*1e9", "M2@3+", "@3", "M2 @3"}) {
    EXPECT_NE(message_of([&] { parse_fault(bad, "--fault"); }).find("--fault"), std::string::npos)
        << bad;
  }
  const TemporaryFolder folder;
  write_file(folder.file("script"), "# what goes wrong\nM2@120\n\n  A5@200*1  # interlock\r\n");
  FaultScript script;
  add_faults(folder.file("script"), script);
  EXPECT_NE(script.active(EyeFault::kMissing, 122), nullptr);
  EXPECT_EQ(script.active(EyeFault::kMissing, 123), nullptr);
  ASSERT_NE(script.active(EyeFault::kSwitch, 5000), nullptr);
  EXPECT_EQ(script.active(EyeFault::kSwitch, 5000)->value, 1.0);
  write_file(folder.file("script"), "M2@120\nM2@\n");
  EXPECT_NE(message_of([&] { add_faults(folder.file("script"), script); }).find("script:2"),
            std::string::npos);
  for (std::size_t i = 0; i < FaultScript::kMost; ++i) script.add(fault);
  EXPECT_FALSE(script.add(fault));
}

}  // namespace
}  // namespace photocoag::testing
