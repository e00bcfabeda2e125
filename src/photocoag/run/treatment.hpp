// Role: the program's main job; one closed-loop treatment from a configuration on any device,
// solver and estimator, supervised or not. Used by apps, console, session, population, study,
// campaign, python. The pipeline itself is run/treat.hpp. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/estimation/prior_check.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/loop/user_parts.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/device_address.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/observer.hpp"

namespace photocoag {

/// How the crash-safe log ended.
struct LogOutcome {
  LogTotals totals;
  std::int64_t segments = 0;  ///< 0: there was no log
  std::string trouble;        ///< empty: complete
};

/// The device's own report on a treatment.
struct DeviceReport {
  std::string name;
  int pulses_per_period = 0;     ///< 0: unknown
  std::int64_t late_pulses = 0;  ///< answered after the next was due
  double pulse_peak_max = 0.0;   ///< K, true, right after a pulse; NaN: not known
  std::string status;            ///< the eye's status line
  std::string pacing;            ///< of a simulated eye process, as text; else empty
  bool lockstep = false;         ///< the eye waited for the controller: real time was not measured
};

struct Treatment {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  LoopTiming timing;           ///< empty in virtual time
  CycleHistograms histograms;  ///< empty in virtual time
  LogOutcome log;
  GoalWatch goal;
  bool recovered = false;     ///< recovered from a log whose end is missing
  std::string scheduling;     ///< the real-time scheduling granted; empty in virtual time
  PageFaults page_faults;     ///< of the loop's thread during the loop
  double wall_seconds = 0.0;  ///< of the loop alone
  std::size_t full_order_states = 0;
  std::optional<PriorCheck> prior_check;  ///< none: no posterior, or a recovered run
  std::optional<DeviceReport> device;     ///< none: the simulated eye of this process
};

/// A passive viewer of a running treatment.
struct TreatmentMonitor {
  SpscRing<LogRecord>* live = nullptr;  ///< receives every cycle; if full, cycles are dropped
  /// Called before the loop, on its thread, with the self-test's result, passed or not. May be
  /// empty.
  std::function<void(const SelfTestReport&, const SafetyLimits&)> self_tested;
};

/// The self-test on the simulated eye of this process: samples of the cold eye at 0 W and a trip of
/// its watchdog.
SelfTestReport self_test_eye(const Config& config, bool log_has_room);

/// Throws Error if the loop may not run on safety.core or, with safety.real_time = "enforce", if
/// this machine does not grant SCHED_FIFO and locked memory to a new thread.
void require_real_time(const Config& config);

/// Opens the device, runs its self-test and treats. In virtual time on the calling thread, else on
/// a new thread. `progress` counts cycles and may be read by another thread. Throws Error, for a
/// device DeviceError, only before the loop. `log_folder`: of the crash-safe log; empty: none.
Treatment run_treatment(const Config& config, ModelStore& models, const DeviceAddress& place,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
                        const std::filesystem::path& log_folder = {}, LogOptions log_options = {},
                        const TreatmentMonitor& monitor = {});

/// The same for an existing run folder. `controlled`: the configuration with reference and limit
/// backed off if a margin is wanted. The log goes into `folder` unless in virtual time; an eye
/// process, if any, is started with the folder's config.toml.
Treatment treat_into(const std::filesystem::path& folder, const Config& controlled,
                     const DeviceAddress& place, ModelStore& models, const std::atomic<bool>& stop,
                     std::atomic<std::size_t>& progress, const TreatmentMonitor& monitor = {});

/// True if the reason is a fault of the device.
bool is_device_fault(SafetyReason reason) noexcept;

/// The simulated eye's physics: `full` or `reduced`.
struct EyeModel {
  std::shared_ptr<const FullOrderModel> full;
  const ReducedModel* reduced = nullptr;
  bool sampled = false;  ///< `full` runs as a SampledPlant unless the bench has intersample timing
};

/// Differences of the simulated eye from the model that have no configuration key.
struct PlantMismatch {
  double sensor_gain = 1.0;    ///< error of the calibration, on top of plant.sample_gain
  double sensor_offset = 0.0;  ///< K
  std::optional<int> delay;    ///< periods; default: control.delay_cycles
  bool self_test = true;       ///< false: assumed passed (for thousands of eyes)
};

/// One treatment in virtual time on the calling thread with given models; only the supervisor's
/// observer is computed from the configuration's tissue. Throws Error on bad settings.
Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const PlantMismatch& options = {});

/// The closed loop of run_treatment in virtual time on the calling thread, with the user's
/// controller or tissue. Throws Error only before the loop.
Treatment simulate_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                        const UserParts& own, const std::atomic<bool>& stop,
                        std::atomic<std::size_t>& progress);

}  // namespace photocoag
