// The program `photocoag`: the list of its commands, each a file beside this one; --version; the
// exit code.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "stack.hpp"

namespace {

using namespace photocoag;

constexpr int kExitNotPrinted = 1;

// Grouped by purpose, as in --help.
const std::vector<CommandGroup> kGroups = {
    {"Treat", {"treat", "simulate", "console", "session", "config"}},
    {"Model",
     {"response", "reduce", "field", "export", "export-c", "export-fmu", "certify", "boundaries",
      "discretizations", "information"}},
    {"Study", {"reproduce", "explain", "sweep", "compare", "campaign", "spots", "estimation"}},
    {"Device", {"eye", "calibrate", "driver-check", "convert", "replay", "runs", "faults"}},
    {"Machine", {"doctor", "latency", "bench", "completion"}}};

char** the_arguments = nullptr;

// The parser handles --version before the other arguments.
std::string version_text(int argc, char** argv) {
  char** const end = argv + argc;
  if (std::find(argv + 1, end, std::string_view("--json")) == end) {
    return fmt::format("photocoag {} (source {})\n{}", version(), source_hash(), kResearchNotice);
  }
  return version_object();
}

/// For exceptions that cannot be caught, e.g. out of memory in a library's destructor. Programs
/// that hold a device replace it (rt/last_resort.hpp).
[[noreturn]] void refuse_to_go_on() noexcept {
  constexpr std::string_view kSaid = "photocoag: out of memory: the program ends\n";
  if (write(STDERR_FILENO, kSaid.data(), kSaid.size()) < 0) _exit(kExitBadInput);
  _exit(kExitBadInput);
}

int run_command(int argc, char** argv) {
  if (argc == 2 && argv[1] == std::string_view("--version")) {
    print("{}\n", version_text(argc, argv));
    return 0;
  }
  return run_program(
      {.name = "photocoag",
       .description =
           "photocoag: real-time model predictive control of retinal laser treatment.\n"
           "Heats a spot of a simulated eye to a wanted peak temperature that cannot be measured, "
           "with a laser power computed every millisecond from a noisy volume temperature.",
       .footer = footer(
           "  photocoag treat                                  one treatment, paced by the clock\n"
           "  photocoag simulate --set plant.absorption_factor=0.5\n"
           "  photocoag config                                 every key, its unit, range and "
           "default\n"
           "  photocoag COMMAND --help                         what a command does, with examples"),
       .version = [=] { return version_text(argc, argv); }},
      kGroups, argc, argv);
}

}  // namespace

char** photocoag::program_arguments() noexcept { return the_arguments; }

int main(int argc, char** argv) {
  the_arguments = argv;
  std::set_terminate(refuse_to_go_on);
  prepare_console();
  int exit_code = kExitBadInput;
  try {
    exit_code = with_usual_stack([&] { return run_command(argc, argv); });
  } catch (const photocoag::Error& error) {
    say("photocoag: {}\n", error.what());
  } catch (const std::exception& error) {
    say("photocoag: unexpected failure: {}\n", error.what());
  }
  const bool printed = everything_printed();
  return exit_code == 0 && !printed ? kExitNotPrinted : exit_code;
}
