// A4 with the eye's process gone. The other rows that need processes: tests/processes.
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <vector>

#include "estimation/test_models.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/shared_eye.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

struct Mapping {
  Mapping()
      : memory(static_cast<SharedEyeMemory*>(mmap(nullptr, sizeof(SharedEyeMemory),
                                                  PROT_READ | PROT_WRITE,
                                                  MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {}
  ~Mapping() { munmap(memory, sizeof(SharedEyeMemory)); }
  SharedEyeMemory* memory;
};

TEST(ProcessFaults, A4WithoutTheEyeTheControllerStops) {
  // Nobody ticks: every wait times out, the third stops.
  Mapping mapping;
  SharedEyeDevice device(*mapping.memory, 1e-3);
  Supervisor supervisor = treating_supervisor(model_1khz());
  Controller controller(model_1khz(), {}, {});
  std::vector<CycleRecord> records(20);
  const LoopOutcome outcome = run_loop(controller, device, supervisor, 1e-3, std::span(records));
  EXPECT_EQ(outcome.safety.state, SafetyState::kSafeStop);
  EXPECT_LE(outcome.safety.exposure, 3e-3);
  EXPECT_EQ(mapping.memory->command.load(), 0.0);
}

}  // namespace
}  // namespace photocoag::testing
