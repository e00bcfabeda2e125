// Role: online; an acquisition program in any language as a Device: in each control period it sends
// one datagram and receives one. Used by run, tests. Source: docs/devices.md, "An acquisition
// program". Units: SI. Real time: the calls of the loop are noexcept, bounded and allocation-free;
// wait_sample blocks by design. Threads: one owner.
#pragma once

#include <netinet/in.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include "photocoag/device/device.hpp"

namespace photocoag {

static_assert(std::endian::native == std::endian::little, "the datagrams are little-endian");

inline constexpr std::uint32_t kUdpMagic = 0x474F4350;  // "PCOG"
inline constexpr std::uint16_t kUdpVersion = 1;

enum class UdpKind : std::uint16_t { kHello = 1, kSample, kWelcome, kPower, kOff };

struct UdpHead {
  std::uint32_t magic = kUdpMagic;
  std::uint16_t version = kUdpVersion;
  UdpKind kind = UdpKind::kHello;
  std::uint64_t session = 0;  ///< from the welcome; 0 in a hello
};

struct UdpHello {
  UdpHead head;
  std::int64_t period_ns = 0;
  std::uint64_t simulated = 0;  ///< 1: it cannot emit light
  std::array<char, 40> name{};  ///< padded with zeros
};

enum UdpFlag : std::uint64_t {
  kUdpSaturated = 1U << 0U,
  kUdpStopAsked = 1U << 1U,
  kUdpInterlockClosed = 1U << 2U,
  kUdpShutterOpen = 1U << 3U,
  kUdpFootSwitch = 1U << 4U
};
inline constexpr std::uint64_t kUdpFlags = (1U << 5U) - 1;  ///< all of them

/// Members as in DeviceSample and Readback; sequence and time are the program's.
struct UdpSample {
  UdpHead head{.kind = UdpKind::kSample};
  std::uint64_t sequence = 0;
  std::int64_t time_ns = 0;
  double volume_temperature = 0.0;
  double power = 0.0;
  double command = 0.0;
  std::int64_t raw = 0;
  std::uint64_t flags = 0;
};

/// A datagram to the program: a welcome, a power, or the final 0 W.
struct UdpAnswer {
  UdpHead head;
  std::uint64_t period = 0;  ///< sequence number of the first period of this power
  std::uint64_t token = 0;
  double power = 0.0;  ///< W
};
static_assert(sizeof(UdpHello) == 72 && sizeof(UdpSample) == 72 && sizeof(UdpAnswer) == 40);

/// Counts of ignored datagrams.
struct UdpDrops {
  std::uint64_t foreign = 0;     ///< of another sender
  std::uint64_t unreadable = 0;  ///< wrong size, magic, version, kind or session
  std::uint64_t impossible = 0;  ///< a value out of range
  std::uint64_t old = 0;         ///< of an earlier period: repeated or out of order
  std::uint64_t untimely = 0;    ///< more than half a period off its due time
};

class UdpDevice {
 public:
  /// `address`: [HOST:]PORT to listen at. `delay`: periods from a sample to the power computed from
  /// it; `period`: s. Waits ten seconds for a program that sends a hello and then a sample in each
  /// period. Throws Error, unless `light_allowed` also for a program that is not simulated.
  UdpDevice(const std::string& address, int delay, double period, bool light_allowed);
  ~UdpDevice();
  UdpDevice(const UdpDevice&) = delete;
  UdpDevice& operator=(const UdpDevice&) = delete;

  const std::string& name() const noexcept { return name_; }
  const UdpDrops& drops() const noexcept { return drops_; }
  /// Text with the counts of missing and ignored datagrams.
  std::string status() const;

  /// The next period is cycle 0; cycles, samples and tokens are counted from there. Blocks for some
  /// periods, at 0 W, to find when samples are due.
  void begin() noexcept;

  /// Blocks until half a period after the sample is due, at most one and a half periods.
  DeviceSample wait_sample(std::uint64_t cycle) noexcept;
  Readback readback() noexcept { return readback_; }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept;
  void heartbeat(std::uint64_t) noexcept {}
  /// Sends 0 W; the program gets no token afterwards.
  void safe_off() noexcept;

 private:
  struct Datagram {
    std::array<std::byte, sizeof(UdpSample)> bytes;
    std::size_t size;
    sockaddr_in from;
    std::int64_t received_ns;  // CLOCK_MONOTONIC
  };
  struct Socket {
    int descriptor = -1;
    ~Socket();
  };

  void listen(const std::string& address);
  UdpHello await_hello(std::int64_t give_up_ns);
  bool anchor(std::int64_t give_up_ns) noexcept;
  bool receive(Datagram& datagram) noexcept;
  void wait_until_readable(std::int64_t deadline_ns) const noexcept;
  bool read(const Datagram& datagram, UdpSample& sample) noexcept;
  bool timely(const UdpSample& sample, std::int64_t received_ns) const noexcept;
  void keep(const UdpSample& sample, std::int64_t received_ns) noexcept;
  void take_readback() noexcept;
  bool send(UdpKind kind, double power = 0.0, std::uint64_t token = 0) const noexcept;

  Socket socket_;
  std::string where_;
  std::string name_;
  int delay_;
  std::int64_t period_ns_;
  sockaddr_in peer_{};
  std::uint64_t session_ = 0;
  std::uint64_t next_ = 1;   // sequence number of the awaited period
  std::int64_t due_ns_ = 0;  // its end, CLOCK_MONOTONIC
  UdpSample last_;  // accepted: of a period before `next_`, or of a later one, kept for its turn
  std::int64_t last_received_ns_ = 0;
  std::int64_t empty_ns_ = 0;  // time when nothing was left to receive
  Readback readback_;
  UdpDrops drops_;
  std::uint64_t missing_ = 0;  // periods without a sample
  std::uint64_t token_ = 0;
  std::uint64_t samples_before_ = 0;
  std::uint64_t tokens_before_ = 0;
  bool off_ = false;
};
static_assert(Device<UdpDevice>);

}  // namespace photocoag
