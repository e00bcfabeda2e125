// `photocoag replay`: repeats a recorded run and compares every power.

#include "photocoag/run/replay.hpp"
#include "command.hpp"
#include "console.hpp"
#include "options.hpp"

namespace photocoag {
namespace {

struct ReplayOptions {
  std::string run;  ///< run folder
  bool no_cache = false;
};

int replay_command(const ReplayOptions& options) {
  const ReplayOutcome outcome = replay_run(options.run, !options.no_cache);
  if (outcome.same()) {
    print("{} powers compared: the same to the last bit\n", outcome.compared);
    return 0;
  }
  print("the power of cycle {} differs from the recorded one\n", outcome.differs_at);
  return 1;
}

const Command kReplay(
    "replay", "feed a recorded run to the controller again and compare every power", replay_command,
    [](CommandLine& command, ReplayOptions& options) {
      command.add_option("RUN", options.run, "run folder").required().type_name("DIR");
      command.add_flag("--no-cache", options.no_cache,
                       "make the reduced model again, without the cache");
      command.footer(
          footer("  photocoag simulate --out runs/first\n"
                 "  photocoag replay runs/first\n"
                 "Same build, same machine: the same bits."));
    });

}  // namespace

}  // namespace photocoag
