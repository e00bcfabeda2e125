// Role: the program; it exists twice. `photocoag` starts in 3 ms: it links none of HDF5, matio, MPI
// and libwebsockets. `photocoag-full` has them all, and `photocoag` becomes it (exec) for the
// commands below. They are added by full_commands.cpp there and by handed_over.cpp here.
#pragma once

#include <filesystem>
#include <initializer_list>

namespace CLI {
class App;
}

namespace photocoag {

struct CommandName {
  const char* name;
  const char* description;
};

inline constexpr CommandName kCampaign{
    "campaign", "thousands of virtual spots with random tissue, on all cores and machines"};
inline constexpr CommandName kSession{
    "session", "many spots, one device, one folder: a list or grid, with limits for all of it"};
inline constexpr CommandName kConsole{
    "console", "treat live in the browser: a page on this machine alone, spot after spot"};
inline constexpr CommandName kConvert{
    "convert", "the log of a run as CSV, HDF5 or MAT; or the run folder of a program that died"};
inline constexpr CommandName kCompletion{
    "completion", "what a shell completes, commands, options and keys; or the manual page"};

/// Those five, to `app`. `argv`: the program's own, for the other program.
void add_full_commands(CLI::App& app, int& exit_code, char** argv);

/// The first of `places` that exists, seen from the program's folder and from up to `above` folders
/// above it; empty: none does.
std::filesystem::path find_from_program(std::initializer_list<const char*> places, int above);

}  // namespace photocoag
