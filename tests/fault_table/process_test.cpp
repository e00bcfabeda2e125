// A4 with the eye's process gone. The other rows that need processes: tests/processes.
#include <gtest/gtest.h>

#include <vector>

#include "estimation/test_models.hpp"
#include "photocoag/fault_table/shared_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

TEST(ProcessFaults, A4WithoutTheEyeTheControllerStops) {
  // Nobody ticks: every wait times out, the third stops.
  const SharedEyeMapping memory;
  SharedEyeDevice device(*memory, 1e-3);
  Supervisor supervisor = treating_supervisor(model_1khz());
  Controller controller(model_1khz(), {}, {});
  std::vector<CycleRecord> records(20);
  const LoopOutcome outcome = run_loop(controller, device, supervisor, 1e-3, std::span(records));
  EXPECT_EQ(outcome.safety.state, SafetyState::kSafeStop);
  EXPECT_LE(outcome.safety.exposure, 3e-3);
  EXPECT_EQ(memory->command.load(), 0.0);
}

}  // namespace
}  // namespace photocoag::testing
