#include "photocoag/run/reasons.hpp"

#include <algorithm>
#include <iterator>

namespace photocoag {

namespace {

constexpr std::string_view kSignal = "Check transducer, trigger and converter.";
constexpr std::string_view kSource =
    "Check transducer, trigger and converter; if they are late, see photocoag doctor: what makes "
    "them needs real-time priority, too.";
constexpr std::string_view kLaser = "Measure the laser's power before the next spot.";
constexpr std::string_view kModel =
    "Check spot size, tissue and calibration: the eye does not behave as the model says.";
constexpr std::string_view kMachine = "Free the machine of other work; see photocoag doctor.";
constexpr std::string_view kReportIt = "Keep the run folder and report it.";

struct Row {
  SafetyReason reason;
  ReasonWords words;
};

constexpr Row kRows[] = {
    {SafetyReason::kNone, {"The planned end was reached.", ""}},
    {SafetyReason::kSampleMissing, {"Samples in a row are missing or came too late.", kSource}},
    {SafetyReason::kSampleStale, {"Samples are old, repeated or out of order.", kSignal}},
    {SafetyReason::kSampleStuck, {"The converter's code does not change.", kSignal}},
    {SafetyReason::kSampleSaturated, {"The converter is at its rail.", kSignal}},
    {SafetyReason::kSampleRejected, {"Samples are implausible for the emitted power.", kModel}},
    {SafetyReason::kMeasurementNoise,
     {"The measurement's noise is not the calibrated one.", kSignal}},
    {SafetyReason::kPowerReadback, {"The power read back is not the power commanded.", kLaser}},
    {SafetyReason::kPowerStuckOn, {"The laser emits with 0 W commanded.", kLaser}},
    {SafetyReason::kWriteFailed, {"A power could not be written to the device.", kLaser}},
    {SafetyReason::kDeviceGone, {"The device has vanished.", "Check its connection."}},
    {SafetyReason::kInterlock, {"The interlock opened.", "Close it."}},
    {SafetyReason::kShutter, {"The shutter is closed.", "Open it."}},
    {SafetyReason::kFootSwitch, {"The foot switch was released.", ""}},
    {SafetyReason::kInfeasible,
     {"The peak is predicted above its limit even at 0 W, 20 cycles in a row.", kModel}},
    {SafetyReason::kSolverFailed, {"The solver found no answer.", kReportIt}},
    {SafetyReason::kCommandInvalid, {"The controller asked for an impossible power.", kReportIt}},
    {SafetyReason::kEstimatorRestart, {"The estimator restarted twice.", kModel}},
    {SafetyReason::kAbsorption, {"The estimated absorption left its bounds or jumps.", kModel}},
    {SafetyReason::kInconsistent, {"Samples and predictions do not agree.", kModel}},
    {SafetyReason::kEstimatedPeak, {"The estimated peak exceeded the limit by 1 K.", kModel}},
    {SafetyReason::kOverrun, {"The loop missed its deadlines.", kMachine}},
    {SafetyReason::kEnergy, {"The energy limit was reached.", ""}},
    {SafetyReason::kExposure, {"The exposure limit was reached.", ""}},
    {SafetyReason::kThermalDose, {"The thermal dose limit was reached.", ""}},
    {SafetyReason::kLimitsCorrupted, {"A bit flipped in the limits.", kReportIt}},
    {SafetyReason::kPeakCeiling,
     {"The power was lowered: some plausible absorption would overheat.", ""}},
    {SafetyReason::kSlew, {"The power was lowered to the largest rise allowed.", ""}},
    {SafetyReason::kCoasting, {"The power did not rise without a fresh sample.", ""}},
    {SafetyReason::kSelfTest,
     {"The self-test failed.", "Correct the items marked above, then reset."}},
    {SafetyReason::kNotTreating, {"Not treating: 0 W.", ""}},
    {SafetyReason::kCommandLate, {"Commands reach the device late.", kMachine}},
};

}  // namespace

ReasonWords words_of(SafetyReason reason) noexcept {
  const Row* found = std::ranges::find(kRows, reason, &Row::reason);
  return found == std::end(kRows) ? ReasonWords{} : found->words;
}

}  // namespace photocoag
