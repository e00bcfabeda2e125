// Role: tests; closed loops of the C++ controller, replayed by exported ones.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "export/exported.hpp"
#include "photocoag/loop/controller.hpp"

namespace photocoag::testing {

/// Settings whose replay is asked for, and a model for their period.
struct ReplayCase {
  std::string name;
  ControlSettings control;
  EstimatorSettings estimator = {};
};

/// The paper's four weights at 250 Hz, and what else the exported controller carries, so that
/// limits are active and change.
std::vector<ReplayCase> replay_cases(int horizon);

/// The same with the posterior estimator and the limit of a stated probability, and the model.
std::vector<ReplayCase> chance_cases(int horizon);
ReducedModel chance_model(const ReplayCase& what);

/// What the controller got and gave in one period.
struct ReplayCycle {
  double sample = 0.0;  ///< K; NaN: missing
  double applied = 0.0;
  double power = 0.0;  ///< W, of the C++ controller
  double peak = 0.0;   ///< K, its estimate
  MpcStatus status = MpcStatus::kFailed;
  UpdateStatus use = UpdateStatus::kNoSample;
  int changes = 0;
  bool limited = false;  ///< the peak limit, or a bound of the first power, holds with equality
  bool first = false;    ///< of a treatment: start() instead of step()
};

/// Treatments of 250 periods of eyes that differ, with noise, outliers, missing samples and powers
/// that are not quite those commanded.
std::vector<ReplayCycle> record(const ReducedModel& model, const ReplayCase& what, int cycles,
                                std::uint64_t seed);

struct ReplayDifference {
  double power = 0.0;  ///< W
  double peak = 0.0;   ///< K
  int worst = -1;      ///< cycle of the largest difference of powers
  int cycles = 0;
  int beyond = 0;  ///< cycles that differ by more than kSingleBar
};

/// 1e-5 W of 0.06 W and 1e-3 K of 30 K: single precision.
inline constexpr ReplayDifference kSingleBar{.power = 1e-5, .peak = 1e-3};

ReplayDifference replay(const Exported& exported, const std::vector<ReplayCycle>& recorded);

}  // namespace photocoag::testing
