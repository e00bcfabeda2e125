// `photocoag replay`: a recorded run again, power by power.
#include <fmt/format.h>

#include "commands.hpp"
#include "console.hpp"
#include "photocoag/run/replay.hpp"

namespace photocoag {

int replay_command(const ReplayOptions& options) {
  const ReplayOutcome outcome = replay_run(options.run, !options.no_cache);
  if (outcome.same()) {
    print("{} powers compared: the same to the last bit\n", outcome.compared);
    return 0;
  }
  print("the power of cycle {} differs from the recorded one\n", outcome.differs_at);
  return 1;
}

}  // namespace photocoag
