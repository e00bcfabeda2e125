// The doctor reads what is there; the latency tool counts every wake-up.
#include <gtest/gtest.h>

#include <fstream>

#include "photocoag/realtime_check/doctor.hpp"
#include "photocoag/realtime_check/latency.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

constexpr Privileges kAll{
    .fifo = true, .locked = true, .rt_priority_limit = 99, .locked_bytes_limit = UINT64_MAX};

struct Machine {
  TemporaryFolder folder;
  void put(const std::string& name, const std::string& text) {
    const std::filesystem::path file = folder.path() / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  Finding find(const std::string& topic, const Privileges& privileges = kAll) {
    for (const Finding& finding : examine(privileges, folder.path())) {
      if (finding.topic == topic) return finding;
    }
    ADD_FAILURE() << "no finding about " << topic;
    return {};
  }
};

TEST(Doctor, ATunedMachineIsGoodThroughout) {
  Machine m;
  m.put("proc/version", "Linux version 6.12.0-rt SMP PREEMPT_RT Debian\n");
  m.put("proc/cpuinfo", "processor : 0\nflags : fpu tsc\n\nprocessor : 1\nflags : fpu tsc\n");
  m.put("proc/swaps", "Filename Type Size Used Priority\n");
  m.put("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
  m.put("sys/devices/system/cpu/isolated", "1\n");
  m.put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  m.put("sys/devices/system/cpu/cpu0/cpuidle/state1/latency", "2\n");
  m.put("sys/devices/system/cpu/cpu0/cpuidle/state2/latency", "300\n");
  m.put("sys/devices/system/cpu/cpu0/cpuidle/state2/disable", "1\n");
  m.put("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  m.put("dev/cpu/0/msr", std::string(0x40, '\0'));
  for (const Finding& finding : examine(kAll, m.folder.path())) {
    EXPECT_EQ(finding.health, Health::kGood) << finding.topic << ": " << finding.found;
    EXPECT_TRUE(finding.advice.empty());
  }
}

TEST(Doctor, WhatIsWrongIsNamedWithAdvice) {
  Machine m;
  m.put("proc/version", "Linux version 6.1 SMP PREEMPT_DYNAMIC\n");
  m.put("proc/cpuinfo", "processor : 0\nflags : fpu hypervisor tsc\n");
  m.put("proc/swaps", "Filename Type\n/swapfile file\n");
  m.put("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
  m.put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
  m.put("sys/devices/system/cpu/cpu0/cpuidle/state2/latency", "300\n");
  m.put("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  const Privileges none;
  for (const char* topic :
       {"kernel", "hypervisor", "SCHED_FIFO", "locked memory", "cores", "clock source"}) {
    const Finding finding = m.find(topic, none);
    EXPECT_EQ(finding.health, Health::kBad) << topic;
    EXPECT_FALSE(finding.advice.empty()) << topic;
  }
  for (const char* topic : {"cpu frequency", "idle states", "isolated cores", "swap",
                            "real-time throttling", "firmware interrupts"}) {
    EXPECT_EQ(m.find(topic, none).health, Health::kWarn) << topic;
  }
}

TEST(Doctor, AnEmptyMachineIsNoError) {
  Machine m;
  EXPECT_EQ(examine(kAll, m.folder.path()).size(), 12u);
  EXPECT_FALSE(examine(own_privileges()).empty());
}

TEST(Latency, EveryWakeUpIsCounted) {
  const std::atomic<bool> stop{false};
  const WakeLatency latency = measure_wake_latency(0.05, 1e-3, stop);
  EXPECT_EQ(latency.histogram.counted() + latency.whole_periods_missed, 50u);
  EXPECT_EQ(latency.histogram.negative(), 0u) << "never before the deadline";
  EXPECT_FALSE(latency.scheduling.empty());
}

TEST(Latency, ReadsWhatCyclictestPrints) {
  const DurationHistogram histogram = parse_cyclictest(
      "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000000 000000\n000001 "
      "000003\n000002\t000006\n"
      "# Total: 000000009\n# Min Latencies: 00001\n# Histogram Overflows: 00001\n"
      "# Histogram Overflow at cycle number:\n# Thread 0:\n",
      1e-3);
  EXPECT_EQ(histogram.counted(), 10u);
  EXPECT_EQ(histogram.bins()[1], 3u);
  EXPECT_EQ(histogram.bins()[2], 6u);
  EXPECT_EQ(histogram.overflow(), 1u);
  EXPECT_EQ(histogram.quantile_us(0.5), 3.0);
}

}  // namespace
}  // namespace photocoag::testing
