// Foreign code that changes rounding, traps or the treatment of denormals, and a fault of the
// processor with a device at hand.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cfenv>
#include <csignal>
#include <filesystem>
#include <limits>
#include <string>

#include "photocoag/rt/driver_device.hpp"
#include "photocoag/rt/last_resort.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

constexpr double kPeriod = 1e-3;  // s

/// To nearest, denormals alive, and no trap at a division by zero (it would end the test).
void expect_default(const char* after) {
  EXPECT_EQ(std::fegetround(), FE_TONEAREST) << after;
  volatile double smallest = std::numeric_limits<double>::min();
  EXPECT_GT(smallest / 4.0, 0.0) << after;
  volatile double zero = 0.0;
  EXPECT_GT(1.0 / zero, 1e300) << after;
}

TEST(FloatingPoint, NoCallOfADriverLeavesItChanged) {
  DriverDevice device(PHOTOCOAG_RUDE_DRIVER, "", kPeriod);
  expect_default("open and arm");
  device.wait_sample(0);
  expect_default("wait_sample");
  device.readback();
  expect_default("readback");
  device.write_power(0.01, 1);
  expect_default("write_power");
  device.heartbeat(0);
  expect_default("heartbeat");
  device.safe_off();
  expect_default("safe_off");
}

/// A child that holds the rude driver, runs `act` and is expected to die.
template <typename Act>
int status_of_child(const std::string& mark, Act act) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit none{.rlim_cur = 0, .rlim_max = 0};
    setrlimit(RLIMIT_CORE, &none);
    std::signal(SIGFPE, SIG_DFL);
    std::signal(SIGABRT, SIG_DFL);
    DriverDevice device(PHOTOCOAG_RUDE_DRIVER, "die=" + mark, kPeriod);
    set_last_resort([](void* d) noexcept { static_cast<DriverDevice*>(d)->safe_off(); }, &device);
    act(device);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

TEST(LastResort, ATrapInsideADriverSwitchesOffFirst) {
  const TemporaryFolder folder;
  const int status = status_of_child(folder.file("off"), [](DriverDevice& device) {
    for (std::uint64_t cycle = 0; cycle < 3; ++cycle) device.wait_sample(cycle);
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGFPE) << status;
  EXPECT_TRUE(std::filesystem::exists(folder.file("off"))) << "safe_off was not called";
}

TEST(LastResort, AnAbortSwitchesOffFirst) {
  const TemporaryFolder folder;
  const int status = status_of_child(folder.file("off"), [](DriverDevice&) { std::abort(); });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT) << status;
  EXPECT_TRUE(std::filesystem::exists(folder.file("off")));
}

}  // namespace
}  // namespace photocoag::testing
