// Role: safety tests; the fault table as data, with the demanded reaction of each row. Used by
// fault_trials, tests. Source: docs/safety.md, fault table.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "photocoag/faults/injection.hpp"
#include "photocoag/safety/states.hpp"

namespace photocoag {

enum class Demand : std::uint8_t {
  kStop,            ///< SAFE_STOP for one of `reasons`
  kStandby,         ///< STANDBY
  kDone,            ///< DONE
  kContinue,        ///< detected for one of `reasons`, and the treatment goes on
  kContinueOrStop,  ///< either; the peak is judged
  kReport,          ///< an open hazard: the peak is reported, not judged
  kLegal,           ///< a valid number, perhaps wrong: the estimate must stay finite
};

/// One variant of one row.
struct FaultCase {
  std::string id;    ///< of the row, e.g. "M4"
  std::string what;  ///< in words
  Injection injection;
  Demand demand = Demand::kStop;
  std::vector<SafetyReason> reasons;
  int off_within = 0;   ///< cycles after the first bad datum in which light is still allowed
  double margin = 0.5;  ///< K above the limit that the true peak may reach
  bool estimator_deaf = false;  ///< no bad sample may enter the estimator
  bool interlock = false;       ///< safe_off must be called as well
};

/// All rows that run in virtual time.
std::vector<FaultCase> fault_table();

}  // namespace photocoag
