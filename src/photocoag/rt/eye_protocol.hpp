// Role: simulation and online; protocol between a simulated eye in another process and its
// controller, over shared memory or a Unix socket. Used by eye, rt, run. Source: docs/devices.md,
// "Transports". Units: SI. Real time: lock-free; a process that dies leaves nothing locked.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "photocoag/photoacoustics/transient.hpp"

namespace photocoag {

inline constexpr std::uint32_t kEyeMagic = 0x45594532;  // "EYE2"
inline constexpr std::size_t kEyeRing = 2048;           // pulses kept

enum class EyeTransport : std::uint32_t { kSharedMemory, kSocket };

enum EyeFlag : std::uint32_t {
  kEyeLate = 1U << 0U,        ///< answered after the next pulse was due
  kEyeSilent = 1U << 1U,      ///< no pulse was fired: nothing was measured
  kEyeInterlock = 1U << 2U,   ///< open
  kEyeShutter = 1U << 3U,     ///< closed
  kEyeFootSwitch = 1U << 4U,  ///< released
  kEyeRefused = 1U << 5U      ///< the command in force was beyond the laser's limit: 0 W
};

/// The eye's answer to one pulse: only what a real device could know.
struct PulseRecord {
  std::uint64_t number = 0;      ///< 0, 1, … since the eye started
  std::int64_t time_ns = 0;      ///< when it was due, CLOCK_MONOTONIC
  std::int64_t answered_ns = 0;  ///< when this was published
  std::uint64_t tokens = 0;      ///< commands of the controller received so far
  double power_readback = 0.0;   ///< W (commanded scale), mean over the pulse period
  double period_power = 0.0;     ///< W, the command in force
  std::uint32_t flags = 0;       ///< EyeFlag
  std::uint32_t reserved = 0;
  PulseReading reading;
};

/// For evaluation only, never for the controller.
struct PulseTruth {
  std::uint64_t number = 0;
  double peak_mean = 0.0;    ///< K, over the pulse period after the pulse
  double peak_pulse = 0.0;   ///< K, right after the pulse
  double volume_mean = 0.0;  ///< K, normalised, over the pulse period after the pulse
};
static_assert(std::is_trivially_copyable_v<PulseRecord> &&
              std::is_trivially_copyable_v<PulseTruth>);

/// What the eye publishes, to its controller and to observers: they can neither write it nor change
/// its size. Zero-filled at the start. A ring's entry `number` is valid from the moment `pulses`
/// (or `truths`) exceeds it until kEyeRing pulses later.
struct EyeSharedMemory {
  std::uint32_t magic;
  std::uint32_t size;
  std::atomic<std::int64_t> start_ns;  ///< when pulse 0 was due, or would have been
  std::atomic<std::uint64_t> pulses;
  std::atomic<std::uint64_t> truths;
  std::atomic<std::uint32_t> gone;  ///< the eye has ended
  std::array<PulseRecord, kEyeRing> records;
  std::array<PulseTruth, kEyeRing> truth;
};

/// Written by the attached controller with the shared-memory transport: a new one for each
/// controller, its size sealed.
struct EyeOrderMemory {
  std::uint32_t magic;
  std::uint32_t size;
  /// Slot (period % 4): the power of that period and of those after it.
  struct Command {
    std::atomic<double> power;
    std::atomic<std::uint64_t> token;   ///< 1, 2, …: incremented with each command
    std::atomic<std::uint64_t> period;  ///< + 1; 0: none
  };
  std::array<Command, 4> commands;
  std::atomic<std::uint32_t> safe_off;
  std::atomic<std::uint64_t> granted;  ///< pulses that the eye may fire, in lockstep
};
static_assert(std::atomic<double>::is_always_lock_free);
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

/// Messages on the socket (SOCK_SEQPACKET). A first byte of 32 or more begins a line of text: a
/// command for the eye, answered by text.
enum class EyeMessageKind : std::uint32_t {
  kHello = 1,
  kCommand,  ///< `power` from `period` on
  kSafeOff,  ///< 0 W, interlock open
  kBegin,    ///< the treatment's cycle 0 is `period`; scripted faults count from there
  kWelcome,
  kLockstep,  ///< from now on pulses only when granted; answered by EyeLockstep
  kGrant      ///< pulses before number `period` may be fired
};

struct EyeHello {
  EyeMessageKind kind = EyeMessageKind::kHello;
  std::uint32_t magic = kEyeMagic;
  std::uint32_t pulses_per_period = 1;
  EyeTransport transport = EyeTransport::kSharedMemory;
};
inline constexpr std::uint32_t kMostPulsesPerPeriod = 1000;

enum EyeAbility : std::uint32_t {
  kEyeHasPriority = 1U << 0U,  ///< SCHED_FIFO
  kEyeNeedsWall = 1U << 1U     ///< its scripted faults need wall time
};

/// With the shared-memory transport two descriptors come along: EyeSharedMemory, EyeOrderMemory.
struct EyeWelcome {
  EyeMessageKind kind = EyeMessageKind::kWelcome;
  std::uint32_t magic = kEyeMagic;
  std::int64_t start_ns = 0;
  std::int64_t pulse_period_ns = 0;
  std::uint64_t states = 0;  ///< of its full-order model
  double power_max = 0.0;    ///< W
  std::uint32_t abilities = 0;
  std::uint32_t reserved = 0;
};
struct EyeCommand {
  EyeMessageKind kind = EyeMessageKind::kCommand;
  std::uint32_t reserved = 0;
  std::uint64_t period = 0;
  double power = 0.0;
  std::uint64_t token = 0;
};
/// The eye is in lockstep and has fired `pulses` pulses.
struct EyeLockstep {
  EyeMessageKind kind = EyeMessageKind::kLockstep;
  std::uint32_t reserved = 0;
  std::uint64_t pulses = 0;
};
/// Eye to controller with the socket transport: a PulseRecord, or a PulseTruth; told apart by size.
static_assert(sizeof(PulseRecord) != sizeof(PulseTruth) &&
              sizeof(PulseRecord) != sizeof(EyeLockstep) &&
              sizeof(PulseTruth) != sizeof(EyeLockstep));

}  // namespace photocoag
