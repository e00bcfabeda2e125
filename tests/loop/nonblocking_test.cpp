// The cycle under RealtimeSanitizer (preset `rtsan`, tools/rtsan): a marked function that reaches
// malloc, a lock or a sleep ends the program, so that every other test of this folder is a test of
// it, too. Here: that the sanitizer is awake, and every branch of a step.
#include <gtest/gtest.h>

#include <cstdlib>
#include <mutex>

#include "estimation/test_models.hpp"
#include "photocoag/core/real_time.hpp"
#include "photocoag/loop/controller.hpp"

namespace photocoag::testing {
namespace {

void look_at(void* pointer) { asm volatile("" : : "r"(pointer) : "memory"); }

void allocate() noexcept PHOTOCOAG_NONBLOCKING {
  void* block = std::malloc(100);
  look_at(block);
  std::free(block);
}

std::mutex mutex;
void lock() noexcept PHOTOCOAG_NONBLOCKING {
  mutex.lock();
  mutex.unlock();
}

TEST(Nonblocking, AMarkedFunctionThatAllocatesOrLocksEndsTheProgram) {
  if (!PHOTOCOAG_RTSAN) GTEST_SKIP() << "build with the preset rtsan (tools/rtsan)";
  EXPECT_DEATH(allocate(), "malloc");
  EXPECT_DEATH(lock(), "mutex");
}

TEST(Nonblocking, EveryBranchOfAStep) {
  for (const int horizon : {2, 5, 20, 50}) {
    for (const double weight : {0.0, 1e6}) {
      Controller controller(model_1khz(), {.horizon = horizon, .power_change_weight = weight}, {});
      double sum = controller.decide().power;
      for (int k = 0; k < 60; ++k) {
        // Honest, missing, absurd, hot.
        const double sample = k % 7 == 3 ? Sample{}.volume_temperature
                              : k == 40  ? 1e308
                              : k > 50   ? 250.0
                                         : 0.4 * k;
        sum += controller.step({.volume_temperature = sample, .applied_power = 0.02}).power;
      }
      EXPECT_GT(sum, 0.0);
    }
  }
}

}  // namespace
}  // namespace photocoag::testing
