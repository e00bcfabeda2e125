// Role: simulation; scripted faults of the eye, by the ids of the fault table. Used by eye. Source:
// docs/safety.md, docs/devices.md ("Faults"). Independent of the supervisor.
// Real time: active is noexcept, bounded; add may be called by another thread.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

namespace photocoag {

enum class EyeFault : std::uint8_t {
  kMissing,     ///< M1, M2: no answer
  kOld,         ///< M3: two periods old
  kStuck,       ///< M4: the same transient again
  kNotANumber,  ///< M5: the energy meter says NaN
  kRail,        ///< M6: the converter at its rail
  kSpike,       ///< M7: value is added, K
  kNoise,       ///< M8: noise multiplied by value
  kFuture,      ///< M9: time stamps an hour ahead
  kReadback,    ///< A1: power readback multiplied by value
  kStuckOn,     ///< A2: emits value, W, whatever is commanded
  kDeaf,        ///< A3: commands are lost
  kVanish,      ///< A4: the eye ends
  kSwitch,      ///< A5: shutter (value 0), interlock (1) or foot switch (2)
  kLate,        ///< T1: answers value ms late
};

struct ScriptedFault {
  EyeFault fault = EyeFault::kMissing;
  std::uint64_t start = 0;  ///< control cycle, counted from the first power above 0 W
  std::uint64_t count = 1;
  double value = 0.0;
};

/// "ID@cycle[+count][*value]", e.g. "M2@120", "M8@50*4", "A5@100*1". Throws Error naming what is
/// wrong; `where` is the file or option it came from.
ScriptedFault parse_fault(const std::string& text, const std::string& where);

/// True for late answers and an eye that ends (T1, A4), which need wall time.
bool takes_wall_time(const ScriptedFault& fault) noexcept;

/// Faults can be added while the eye runs.
class FaultScript {
 public:
  static constexpr std::size_t kMost = 64;
  /// False if it is full.
  bool add(const ScriptedFault& fault) noexcept;
  /// The fault of that kind that is active in this cycle, or nullptr.
  const ScriptedFault* active(EyeFault fault, std::uint64_t cycle) const noexcept;
  bool takes_wall_time() const noexcept;  ///< any of them

 private:
  std::array<ScriptedFault, kMost> faults_{};
  std::atomic<std::size_t> count_{0};
};

/// Adds one fault, or all of a file's: one per line, # starts a comment. Throws Error.
void add_faults(const std::string& text_or_file, FaultScript& script);

}  // namespace photocoag
