// Role: the program's main job; one closed-loop treatment from a configuration, on whatever device.
// Used by `treat`, `simulate`, console, session, spots, margins, studies, campaigns: whatever
// closes the loop does it here, with any solver and estimator, supervised or not. The pipeline
// itself is run/treat.hpp. Units: SI.
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
#include "photocoag/loop/own_parts.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/loop/treatment_loop.hpp"
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

/// What only a treatment on a device knows.
struct DeviceReport {
  std::string name;
  int pulses_per_period = 0;     ///< 0: it does not say
  std::int64_t late_pulses = 0;  ///< answered after the next was due
  double pulse_peak_max = 0.0;   ///< K, true, right after a pulse; NaN: not known
  std::string status;            ///< the eye's own counts, as it says them
  std::string pacing;            ///< of a simulated eye, in words; empty: no such eye
  bool lockstep = false;         ///< it waited for the controller: real time was not measured
};

struct Treatment {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  LoopTiming timing;           ///< empty in virtual time
  CycleHistograms histograms;  ///< empty in virtual time
  LogOutcome log;
  GoalWatch goal;
  bool recovered = false;     ///< from a log whose end is missing
  std::string scheduling;     ///< what real-time treatment was granted; empty in virtual time
  PageFaults page_faults;     ///< of the loop's thread while it treated
  double wall_seconds = 0.0;  ///< of the loop alone
  std::size_t full_order_states = 0;
  std::optional<PriorCheck> prior_check;  ///< none: no posterior, or a recovered run
  std::optional<DeviceReport> device;     ///< none: the simulated eye of this process
};

/// Who looks on while a treatment runs, and changes nothing of it.
struct Onlooker {
  SpscRing<LogRecord>* live = nullptr;  ///< gets every cycle; what finds it full is dropped
  /// Before the loop, on its thread: what the self-test has found, passed or not. May be empty.
  std::function<void(const SelfTestReport&, const SafetyLimits&)> self_tested;
};

/// The self-test on the simulated eye of this process: samples of the cold eye at 0 W and a trip of
/// its watchdog.
SelfTestReport self_test_eye(const Config& config, bool log_has_room);

/// Throws Error unless the loop may run on safety.core. With safety.real_time = "enforce" also
/// unless this machine grants SCHED_FIFO and locked memory to a new thread.
void require_real_time(const Config& config);

/// Opens the device, tests it and treats. In virtual time on the calling thread, else on a thread
/// of its own. `progress` counts cycles and may be read by another thread. Throws Error, of a
/// device DeviceError, before the loop only. `log_folder`: where the crash-safe log goes; empty:
/// none.
Treatment run_treatment(const Config& config, ModelStore& models, const DeviceAddress& place,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
                        const std::filesystem::path& log_folder = {}, LogOptions log_options = {},
                        const Onlooker& onlooker = {});

/// The same for a run folder that is there: by `controlled` (reference and limit backed off where a
/// margin is wanted), with the log in `folder` unless in virtual time; an eye of its own is started
/// with the folder's config.toml.
Treatment treat_into(const std::filesystem::path& folder, const Config& controlled,
                     const DeviceAddress& place, ModelStore& models, const std::atomic<bool>& stop,
                     std::atomic<std::size_t>& progress, const Onlooker& onlooker = {});

/// A device in the words of log and summary; empty: the simulated eye of this process.
std::string describe(const DeviceAddress& place);

/// True if the supervisor stopped for something that the device did.
bool is_device_fault(SafetyReason reason) noexcept;

/// The simulated eye's physics, one of the two.
struct EyeModel {
  std::shared_ptr<const FullOrderModel> full;
  const ReducedModel* reduced = nullptr;
  bool sampled = false;  ///< full: as a SampledPlant unless the bench looks between the samples
};

/// How the simulated eye differs from the model where the configuration has no key for it.
struct PlantMismatch {
  double sensor_gain = 1.0;    ///< error of the calibration, on top of plant.sample_gain
  double sensor_offset = 0.0;  ///< K
  std::optional<int> delay;    ///< periods, if not what control.delay_cycles says
  bool self_test = true;       ///< false: taken as passed (thousands of eyes)
};

/// One treatment in virtual time on the calling thread with models that are there already; of
/// the configuration's tissue only the supervisor's observer is made. Throws Error on bad settings.
Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const PlantMismatch& options = {});

/// The closed loop of run_treatment in virtual time on the calling thread, with parts of one's own
/// in place of the controller or the eye's tissue. Throws Error before the loop only.
Treatment simulate_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                        const OwnParts& own, const std::atomic<bool>& stop,
                        std::atomic<std::size_t>& progress);

}  // namespace photocoag
