#include "photocoag/fault_table/process_trials.hpp"

namespace photocoag {
namespace {

struct ProcessRow {
  const char* id;
  void (*run)(const ProcessFaultOptions& options, FaultRow& row);
  bool
      needs_supervisor;  ///< true: without it the row must fail; the other rows do not depend on it
};

constexpr ProcessRow kRows[] = {
    {"S5", run_eye_row, false},     {"T3", run_eye_row, true},      {"T4", run_eye_row, false},
    {"T5", run_program_row, false}, {"T6", run_program_row, false}, {"T7", run_program_row, false},
    {"F1", run_program_row, false}, {"F2", run_program_row, false}, {"F3", run_program_row, true},
    {"L1", run_log_row, true},      {"L2", run_web_row, false},     {"X2", run_eye_row, false},
    {"X3", run_program_row, false},
};

}  // namespace

std::vector<std::string> process_fault_ids() {
  std::vector<std::string> ids;
  for (const ProcessRow& row : kRows) ids.emplace_back(row.id);
  return ids;
}

std::vector<FaultRow> run_process_faults(const ProcessFaultOptions& options,
                                         const std::function<void(double)>& progress) {
  std::vector<FaultRow> rows;
  double done = 0.0;
  for (const ProcessRow& row : kRows) {
    if (progress) progress(done / static_cast<double>(std::size(kRows)));
    done += 1.0;
    if (!options.only.empty() && options.only != row.id) continue;
    if (!options.supervised && !row.needs_supervisor) continue;
    rows.push_back({.id = row.id, .first_failure = {}, .peak_at = {}});
    row.run(options, rows.back());
  }
  return rows;
}

}  // namespace photocoag
