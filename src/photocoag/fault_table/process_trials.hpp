// Role: safety tests; the rows of the fault table that need processes, the disk or the program
// itself: S5, T3 to T7, F1 to F3, L1, L2, X2, X3. Used by `faults`, tests. Source: docs/safety.md.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "photocoag/fault_table/fault_trials.hpp"

namespace photocoag {

struct ProcessFaultOptions {
  bool supervised = true;  ///< false: without the supervisor; only rows that need it are run
  std::string only;        ///< one id; empty: all
  std::vector<double> absorptions = {0.5, 0.7363, 1.1};
  std::size_t min_cells = 80000;  ///< of the eye
  int kills = 34;                 ///< per absorption, rows T4 and L1
  int allocation_step = 97;       ///< row X3: every n-th allocation fails; 1: all
  std::string program;            ///< path of photocoag itself
  std::string shim;               ///< path of the library of tools/shim
};

/// Ids in the order of the table.
std::vector<std::string> process_fault_ids();

/// Runs each row once per absorption (T4 and L1: `kills` times). Throws Error on set-up.
std::vector<FaultRow> run_process_faults(const ProcessFaultOptions& options,
                                         const std::function<void(double)>& progress = {});

// The rows by kind. Each function fills in `row`.
void run_eye_row(const ProcessFaultOptions& options, FaultRow& row);      // S5, T3, T4, X2
void run_log_row(const ProcessFaultOptions& options, FaultRow& row);      // L1
void run_web_row(const ProcessFaultOptions& options, FaultRow& row);      // L2
void run_program_row(const ProcessFaultOptions& options, FaultRow& row);  // T5 to T7, F1 to F3, X3

/// Counts one run of a row; an empty `why` means passed.
inline void count(FaultRow& row, const std::string& why, bool detected = true) {
  ++row.runs;
  row.passed += why.empty() ? 1 : 0;
  row.detected += detected ? 1 : 0;
  if (!why.empty() && row.first_failure.empty()) row.first_failure = why;
}

}  // namespace photocoag
