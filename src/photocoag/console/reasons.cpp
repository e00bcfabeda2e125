#include "photocoag/console/reasons.hpp"

namespace photocoag {

ReasonWords words_of(SafetyReason reason) noexcept {
  constexpr std::string_view kSignal = "Check transducer, trigger and converter.";
  constexpr std::string_view kLaser = "Measure the laser's power before the next spot.";
  constexpr std::string_view kModel =
      "Check spot size, tissue and calibration: the eye does not behave as the model says.";
  constexpr std::string_view kMachine = "Free the machine of other work; see photocoag doctor.";
  constexpr std::string_view kReportIt = "Keep the run folder and report it.";
  switch (reason) {
    case SafetyReason::kNone:
      return {"The planned end was reached.", ""};
    case SafetyReason::kSampleMissing:
      return {"Three samples in a row are missing.", kSignal};
    case SafetyReason::kSampleStale:
      return {"Samples are old, repeated or out of order.", kSignal};
    case SafetyReason::kSampleStuck:
      return {"The converter's code does not change.", kSignal};
    case SafetyReason::kSampleSaturated:
      return {"The converter is at its rail.", kSignal};
    case SafetyReason::kSampleRejected:
      return {"Samples lie too far from what the emitted power can have caused.", kModel};
    case SafetyReason::kMeasurementNoise:
      return {"The measurement's noise is not the calibrated one.", kSignal};
    case SafetyReason::kPowerReadback:
      return {"The power read back is not the power commanded.", kLaser};
    case SafetyReason::kPowerStuckOn:
      return {"The laser emits with 0 W commanded.", kLaser};
    case SafetyReason::kWriteFailed:
      return {"A power could not be written to the device.", kLaser};
    case SafetyReason::kDeviceGone:
      return {"The device has vanished.", "Check its connection."};
    case SafetyReason::kInterlock:
      return {"The interlock opened.", "Close it."};
    case SafetyReason::kShutter:
      return {"The shutter is closed.", "Open it."};
    case SafetyReason::kFootSwitch:
      return {"The foot switch was released.", ""};
    case SafetyReason::kInfeasible:
      return {"The peak is predicted above its limit even at 0 W, 20 cycles in a row.", kModel};
    case SafetyReason::kSolverFailed:
      return {"The solver found no answer.", kReportIt};
    case SafetyReason::kCommandInvalid:
      return {"The controller asked for an impossible power.", kReportIt};
    case SafetyReason::kEstimatorRestart:
      return {"The estimator restarted twice.", kModel};
    case SafetyReason::kAbsorption:
      return {"The estimated absorption left its bounds or jumps.", kModel};
    case SafetyReason::kInconsistent:
      return {"Samples and predictions do not agree.", kModel};
    case SafetyReason::kEstimatedPeak:
      return {"The estimated peak exceeded the limit by 1 K.", kModel};
    case SafetyReason::kOverrun:
      return {"The loop missed its deadlines.", kMachine};
    case SafetyReason::kEnergy:
      return {"The energy limit was reached.", ""};
    case SafetyReason::kExposure:
      return {"The exposure limit was reached.", ""};
    case SafetyReason::kThermalDose:
      return {"The thermal dose limit was reached.", ""};
    case SafetyReason::kLimitsCorrupted:
      return {"A bit flipped in the limits.", kReportIt};
    case SafetyReason::kPeakCeiling:
      return {"The power was lowered: some plausible absorption would overheat.", ""};
    case SafetyReason::kSlew:
      return {"The power was lowered to the largest rise allowed.", ""};
    case SafetyReason::kCoasting:
      return {"The power did not rise without a fresh sample.", ""};
    case SafetyReason::kSelfTest:
      return {"The self-test failed.", "See to the items marked above, then reset."};
    case SafetyReason::kNotTreating:
      return {"Not treating: 0 W.", ""};
    case SafetyReason::kCommandLate:
      return {"Commands reach the device late.", kMachine};
  }
  return {"", ""};
}

}  // namespace photocoag
