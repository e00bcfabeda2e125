// `photocoag faults`: the fault table, row by row.
#include "faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/fault_table/process_trials.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

// In the build tree beside the program, installed in lib/photocoag.
std::string shim_beside(const std::filesystem::path& program) {
  const std::filesystem::path folder = program.parent_path();
  const char* name = "libphotocoag_shim.so";
  const std::filesystem::path installed = folder.parent_path() / "lib" / "photocoag" / name;
  return (std::filesystem::exists(folder / name) ? folder / name : installed).string();
}

void require_row(const std::string& row) {
  std::vector<std::string> known;
  for (const FaultCase& test : fault_table()) {
    if (known.empty() || known.back() != test.id) known.push_back(test.id);
  }
  for (const std::string& id : process_fault_ids()) known.push_back(id);
  if (row.empty() || std::find(known.begin(), known.end(), row) != known.end()) return;
  throw Error(ErrorParts{.where = "--row",
                         .problem = "there is no such row",
                         .found = row,
                         .accepted = fmt::format("{}", fmt::join(known, ", "))});
}

int faults_command(const FaultsOptions& options) {
  require_row(options.row);
  if (options.kills > 0 || options.stops > 0) return kill_trials(options);
  say("photocoag {}: {}\n", version(), kResearchNotice);
  FaultOptions table{
      .supervised = !options.without_supervisor, .overrides = {}, .only = options.row};
  const auto progress = [](double fraction) { draw_progress("injecting", fraction, "faults"); };
  std::vector<FaultRow> rows = run_fault_table(table, progress);
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  for (FaultRow& row : run_process_faults({.supervised = table.supervised,
                       .only = options.row,
                       .allocation_step = options.allocation_step,
                       .program = program.string(),
                       .shim = shim_beside(program)},
                                          progress)) {
    rows.push_back(std::move(row));
  }
  clear_progress();
  if (rows.empty()) {
    throw Error(ErrorParts{.where = "--row",
                           .problem = "nothing to run without the supervisor",
                           .found = options.row,
                           .accepted = "a row that needs it"});
  }
  print("{:<4} {:>6} {:>6} {:>9} {:>9} {:>8} {:>12}  {}\n", "id", "runs", "passed", "detected",
        "slowest", "peak", "false stops", "first failure");
  bool good = true;
  for (const FaultRow& row : rows) {
    good = good && row.passed == row.runs;
    print("{:<4} {:>6} {:>6} {:>9} {:>9} {:>8.2f} {:>12}  {}\n", row.id, row.runs, row.passed,
          row.detected, row.slowest, row.peak, row.false_stops, row.first_failure);
    if (row.id.front() != 'O') continue;
    for (const auto& [period, peak] : row.peak_at) {
      print("     {:g} ms: {:.2f} K, not judged\n", period * 1e3, peak);
    }
    print("     stopped by the supervisor: {} of {}\n", row.stopped, row.runs);
  }
  print(
      "slowest: cycles after the first bad datum in which there still was light (L1: records lost "
      "by a kill); peak: K, true, limit 32 K; 0: not looked at\n");
  if (options.healthy > 0) {
    const FalseStops stops = count_false_stops(
        options.healthy, table.min_cells,
        [](double fraction) { draw_progress("treating", fraction, "healthy eyes"); });
    clear_progress();
    good = good && stops.stopped == 0;
    print("healthy: {} treatments, {} stopped{}, largest peak {:.2f} K\n", stops.treatments,
          stops.stopped, stops.first_reason.empty() ? "" : " (" + stops.first_reason + ")",
          stops.peak);
  }
  return good ? 0 : 1;
}

const Command kFaults(
    "faults", "inject every fault of docs/safety.md and show how the supervisor reacts",
    faults_command, [](CommandLine& command, FaultsOptions& options) {
      command.add_option("--row", options.row, "one row, e.g. M4; default: all").type_name("ID");
      command.add_flag("--without-supervisor", options.without_supervisor,
                       "without the supervisor: every row must fail");
      command
          .add_option("--healthy", options.healthy,
                      "also this many treatments without faults, to count false stops")
          .check(whole_number_from(1, 1000000))
          .type_name("n");
      command
          .add_option("--kills", options.kills,
                      "instead: SIGKILL this many controllers at random times in treatments of the "
                      "eye's process (row T4)")
          .check(whole_number_from(1, 100000))
          .type_name("n");
      command
          .add_option("--stops", options.stops,
                      "the same with SIGSTOP, and SIGCONT after 20 ms (row T3)")
          .check(whole_number_from(1, 100000))
          .type_name("n");
      command
          .add_option(
              "--allocation-step", options.allocation_step,
              "row X3: of the program's allocations every n-th fails, one at a time; 1: all")
          .check(whole_number_from(1, 1000000))
          .type_name("n");
      command.footer(
          footer("  photocoag faults\n"
                 "  photocoag faults --kills 100\n"
                 "  photocoag faults --row M4\n"
                 "  photocoag faults --healthy 10000\n"
                 "  photocoag faults --without-supervisor"));
    });

}  // namespace

}  // namespace photocoag
