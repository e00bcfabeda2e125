// The promise "allocation-free from the first call" of controller, eye and loop, in the build that
// ships; and that the guard which proves it can fail.
#include <gtest/gtest.h>

#include <malloc.h>

#include <Eigen/Core>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "estimation/test_models.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/run/observer.hpp"
#include "safety/supervisors.hpp"
#include "support/heap_guard.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

/// The compiler may remove an allocation that nobody looks at; not this one.
void look_at(void* pointer) { asm volatile("" : : "r"(pointer) : "memory"); }

template <typename Action>
HeapUse use_of(Action action) {
  const HeapGuard guard;
  action();
  return guard.use();
}

template <typename Take>
void planted_malloc(const char* name, Take take) {
  if (!heap_guard_sees_malloc()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const HeapUse use = use_of([&] {
    void* block = take();
    look_at(block);
    std::free(block);
  });
  EXPECT_EQ(use, (HeapUse{.allocations = 1, .frees = 1})) << name;
}

TEST(HeapGuard, CountsMallocAndItsRelatives) {
  planted_malloc("malloc", [] { return std::malloc(100); });
  planted_malloc("calloc", [] { return std::calloc(10, 10); });
  planted_malloc("realloc", [] { return std::realloc(nullptr, 100); });
  planted_malloc("aligned_alloc", [] { return std::aligned_alloc(64, 128); });
  planted_malloc("memalign", [] { return memalign(64, 100); });
  planted_malloc("valloc", [] { return valloc(100); });
  planted_malloc("posix_memalign", [] {
    void* block = nullptr;
    return posix_memalign(&block, 64, 100) == 0 ? block : nullptr;
  });
  // Called from inside the C library.
  planted_malloc("strdup", [] { return static_cast<void*>(strdup("a string")); });
}

TEST(HeapGuard, CountsEveryFormOfNew) {
  struct alignas(64) Wide {
    char bytes[64];
  };
  const HeapUse once{.allocations = 1, .frees = 1};
  EXPECT_EQ(use_of([] { look_at(std::make_unique<int>(1).get()); }), once);
  EXPECT_EQ(use_of([] { look_at(std::make_unique<int[]>(10).get()); }), once);
  EXPECT_EQ(use_of([] { look_at(std::make_unique<Wide>().get()); }), once);
  EXPECT_EQ(use_of([] { look_at(std::make_unique<Wide[]>(3).get()); }), once);
  EXPECT_EQ(use_of([] { look_at(std::unique_ptr<int>(new (std::nothrow) int(1)).get()); }), once);
  EXPECT_EQ(use_of([] { look_at(std::unique_ptr<Wide>(new (std::nothrow) Wide).get()); }), once);
}

TEST(HeapGuard, CountsWhatHidesInsideLibraries) {
  std::string text = "grows beyond what fits inside";
  EXPECT_GT(use_of([&] {
              for (int k = 0; k < 100; ++k) text += 'x';
              look_at(text.data());
            }).allocations,
            0);
  std::vector<double> values;
  EXPECT_GT(use_of([&] {
              values.push_back(1.0);
              look_at(values.data());
            }).allocations,
            0);
  if (!heap_guard_sees_malloc()) GTEST_SKIP() << "Eigen calls malloc itself";
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(6, 6);
  Eigen::MatrixXd b = a;
  EXPECT_GT(use_of([&] { b = a * b; }).allocations, 0) << "an Eigen temporary of dynamic size";
}

TEST(HeapGuard, CountsNothingWhenNothingHappens) {
  EXPECT_EQ(use_of([] { std::free(nullptr); }), HeapUse{});
  double sum = 0.0;
  EXPECT_EQ(use_of([&] { sum += 1.0; }), HeapUse{});
}

FullOrderPlant full_plant() {
  return FullOrderPlant(small_full_model(), Discretization::kZeroOrderHold, 1e-3, 1.1);
}

TEST(Heap, ControllerAllocatesNothingFromTheFirstCycle) {
  for (const int horizon : {2, 5, 50}) {
    Controller controller(model_1khz(), {.horizon = horizon, .power_change_weight = 1e6}, {});
    double sum = 0.0;
    const HeapUse use = use_of([&] {
      sum += controller.decide().power;
      for (int k = 0; k < 60; ++k) {
        // Honest, missing, absurd: every branch.
        const double sample = k % 7 == 3 ? Sample{}.volume_temperature : k == 40 ? 1e308 : 0.4 * k;
        sum += controller.observe({.volume_temperature = sample, .applied_power = 0.02}).peak_sigma;
        sum += controller.decide().power;
      }
    });
    EXPECT_EQ(use, HeapUse{}) << "N = " << horizon;
    EXPECT_GT(sum, 0.0);
  }
}

TEST(Heap, PlantAndEyeAllocateNothing) {
  FullOrderPlant plant = full_plant();
  ReducedPlant reduced(model_1khz(), 1.1);
  double sum = 0.0;
  const HeapUse stepping = use_of([&] {
    for (int k = 0; k < 10; ++k) {
      plant.step(0.02);
      reduced.step(0.02);
      sum += plant.outputs().peak + reduced.outputs().peak;
    }
  });
  EXPECT_EQ(stepping, HeapUse{});
  SimulatedEye<FullOrderPlant> eye(full_plant(), 0.288, 1);
  const HeapUse watching = use_of([&] {
    for (std::uint64_t k = 0; k < 10; ++k) {
      if (k != 5) eye.write(0.02);
      sum += eye.advance(k).sample.volume_temperature;
    }
  });
  EXPECT_EQ(watching, HeapUse{});
  EXPECT_GT(sum, 0.0);
}

/// Virtual time, with an allocation of the given size in every cycle.
struct LeakyPace : VirtualPace {
  std::string text;
  std::size_t growth = 0;
  std::size_t wait_for_end_of(std::size_t) noexcept {
    text.append(growth, 'x');
    return 0;
  }
};

template <Pace C>
HeapUse use_of_loop(C pace) {
  Controller controller(model_1khz(), {}, {});
  SimulatedEye device(full_plant(), 0.288, 1, {}, std::move(pace));
  if constexpr (requires { device.pace().start(); }) device.pace().start();
  std::vector<CycleRecord> records(20);
  std::atomic<std::size_t> progress{0};
  Supervisor supervisor = treating_supervisor(model_1khz());
  // As `treat` does it: with log and histograms.
  const TemporaryFolder folder;
  LogHeader header;
  header.period = 1e-3;
  LogWriter log(folder.path() / "log", header, {.ring_records = 16, .write = {}});
  TreatmentObserver observer(1e-3, 10, {.progress = &progress, .log = &log});
  const HeapUse use =
      use_of([&] { run_loop(controller, device, supervisor, 1e-3, std::span(records), observer); });
  EXPECT_EQ(log.close().produced, 20u);
  EXPECT_EQ(progress.load(), 20u);
  EXPECT_FALSE(observer.timing().cycle.empty());
  EXPECT_LE(observer.timing().cycle.size(), 10U) << "no more than there is room for";
  return use;
}

TEST(Heap, TheWholeLoopAllocatesNothingInEitherTime) {
  EXPECT_EQ(use_of_loop(VirtualPace(1e-3)), HeapUse{});
  EXPECT_EQ(use_of_loop(ClockPace(1e-3)), HeapUse{});
}

TEST(Heap, AnAllocationInsideTheLoopIsSeen) {
  EXPECT_EQ(use_of_loop(LeakyPace{VirtualPace(1e-3), {}, 0}), HeapUse{});
  EXPECT_GT(use_of_loop(LeakyPace{VirtualPace(1e-3), {}, 100}).allocations, 0);
}

}  // namespace
}  // namespace photocoag::testing
