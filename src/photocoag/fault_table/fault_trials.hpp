// Role: safety tests; runs the fault table on the full-order eye in virtual time. Used by
// `faults`, tests. Source: docs/safety.md.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "photocoag/fault_table/fault_table.hpp"

namespace photocoag {

/// Result of one treatment with a fault.
struct TrialResult {
  std::uint64_t moment = 0;
  bool passed = false;
  bool detected = false;  ///< the supervisor detected it, for one of the demanded reasons
  bool stopped = false;
  bool false_stop = false;  ///< stopped where it had to go on
  int reaction = 0;         ///< cycles after the first bad datum with light; 0: off in that cycle
  double peak = 0.0;        ///< K, largest true peak
  std::string why;          ///< what failed
};

/// All variants of one id together.
struct FaultRow {
  std::string id;
  int runs = 0;
  int passed = 0;
  int detected = 0;
  int stopped = 0;
  int slowest = 0;    ///< cycles, of those that had to stop
  double peak = 0.0;  ///< K
  int false_stops = 0;
  std::string first_failure;
  std::map<double, double> peak_at;  ///< K, by period, s
};

struct FaultOptions {
  bool supervised = true;         ///< false: without the supervisor
  std::size_t min_cells = 80000;  ///< of the eye
  std::vector<double> absorptions = {0.35, 0.5, 0.7363, 1.1, 1.5};
  std::vector<int> horizons = {2, 5};
  std::vector<double> periods = {1e-3, 4e-3};             ///< s
  std::vector<double> open_periods = {1e-4, 1e-3, 4e-3};  ///< s, of the open hazards
  std::vector<int> delays = {0, 1};                       ///< control.delay_cycles
  std::vector<std::string> overrides;                     ///< of the configuration
  std::string only;                                       ///< one id; empty: all
};

/// Runs all cases at cycles 0 to 5, when the limit is first approached, and at steady state, for
/// all combinations of the options' lists. Throws Error on set-up. `progress`: fraction done.
std::vector<FaultRow> run_fault_table(const FaultOptions& options,
                                      const std::function<void(double)>& progress = {});

/// Fault-free treatments, each with new alpha and noise, and how many the supervisor stopped.
struct FalseStops {
  int treatments = 0;
  int stopped = 0;
  double peak = 0.0;         ///< K, the largest true peak
  std::string first_reason;  ///< empty: none
};
FalseStops count_false_stops(int treatments, std::size_t min_cells,
                             const std::function<void(double)>& progress = {});

}  // namespace photocoag
