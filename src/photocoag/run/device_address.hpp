// Role: the program; the device of a treatment: `--device`, or the simulated eye of this process.
// Used by run, session, apps. Source: docs/devices.md.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/usage.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {

struct DeviceAddress {
  enum class Kind : std::uint8_t {
    kVirtual,        ///< the simulated eye of this process in virtual time
    kPaced,          ///< the same, paced by the clock
    kEye,            ///< the simulated eye of another process, through shared memory
    kEyeOverSocket,  ///< the same through its socket
    kDriver,         ///< a vendor's driver
    kUdp,            ///< an acquisition program, by datagrams
  };
  Kind kind = Kind::kPaced;
  bool own_process = false;              ///< an eye process that the program starts and ends itself
  std::string path = {};                 ///< socket, library, or [HOST:]PORT
  std::string settings = {};             ///< of a driver
  std::vector<std::string> faults = {};  ///< scripted faults of an eye started for this treatment

  bool here() const noexcept { return kind == Kind::kVirtual || kind == Kind::kPaced; }
  bool eye() const noexcept { return kind == Kind::kEye || kind == Kind::kEyeOverSocket; }
  bool simulated() const noexcept { return here() || eye(); }
};

/// The simulated eye of this process as fast as it can.
inline DeviceAddress virtual_eye() { return {.kind = DeviceAddress::Kind::kVirtual}; }

/// A device's word, WORD[:PATH[,SETTINGS]], and its properties before it is opened.
struct DeviceWord {
  enum class Path : std::uint8_t {
    kOptional,
    kNeeded,
    kLibrary
  };  ///< settings may follow the last
  std::string_view word;
  DeviceAddress::Kind kind;
  Use use;  ///< of the configuration
  Path path;
  std::string_view described;  ///< in the log, followed by a needed path
};
inline constexpr std::array kDeviceWords{
    DeviceWord{"eye", DeviceAddress::Kind::kEye, Use::kTreatEye, DeviceWord::Path::kOptional,
               "eye, shared memory"},
    DeviceWord{"eye+socket", DeviceAddress::Kind::kEyeOverSocket, Use::kTreatEye,
               DeviceWord::Path::kOptional, "eye, socket"},
    DeviceWord{"driver", DeviceAddress::Kind::kDriver, Use::kTreatDriver,
               DeviceWord::Path::kLibrary, "driver"},
    DeviceWord{"udp", DeviceAddress::Kind::kUdp, Use::kTreatDriver, DeviceWord::Path::kNeeded,
               "udp"},
};
inline constexpr std::string_view kDeviceForms =
    "eye, eye:SOCKET, eye+socket[:SOCKET], driver:LIBRARY[,SETTINGS] or udp:[HOST:]PORT";
inline constexpr const char* kDeviceHelp =
    "eye: a simulated eye in a process of its own, started for this treatment; "
    "eye:SOCKET: one that runs already; eye+socket: pulses through the socket; "
    "driver:LIBRARY[,SETTINGS]: a vendor's driver; udp:[HOST:]PORT: an acquisition program, "
    "by datagrams";

/// kDeviceForms. LIBRARY is the longest part up to a comma that is a file: its path may contain
/// commas. Throws Error naming --device.
DeviceAddress parse_device(const std::string& text);

/// The use of the configuration on that device.
Use use_of(const DeviceAddress& place) noexcept;

/// Of `--device`; empty for the simulated eye of this process.
std::string_view word_of(const DeviceAddress& place) noexcept;

/// The device's name in the log; empty: the simulated eye of this process.
std::string describe(const DeviceAddress& place);

/// A missing or failing device: exit code 3.
class DeviceError : public Error {
 public:
  using Error::Error;
  explicit DeviceError(const Error& error) : Error(error) {}
};

}  // namespace photocoag
