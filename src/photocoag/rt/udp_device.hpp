// Role: online; an acquisition program of any language as a Device: each control period it sends
// one datagram and gets one. Used by run, tests. Source: docs/devices.md, "An acquisition program".
// Units: SI. Real time: the calls of the loop are noexcept, bounded and allocation-free;
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
  std::uint64_t session = 0;  ///< of the welcome; 0 in a hello
};

struct UdpHello {
  UdpHead head;
  std::int64_t period_ns = 0;
  std::uint64_t simulated = 0;  ///< 1: no light can come out
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

/// Members as in DeviceSample and Readback; sequence and time by the program's clock.
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

/// What the program gets: a welcome, a power, or 0 W for good.
struct UdpAnswer {
  UdpHead head;
  std::uint64_t period = 0;  ///< the sequence number of the period from which the power holds
  std::uint64_t token = 0;
  double power = 0.0;  ///< W
};
static_assert(sizeof(UdpHello) == 72 && sizeof(UdpSample) == 72 && sizeof(UdpAnswer) == 40);

/// Datagrams that were not used.
struct UdpDrops {
  std::uint64_t foreign = 0;     ///< another sender's
  std::uint64_t unreadable = 0;  ///< size, magic, version, kind, session
  std::uint64_t impossible = 0;  ///< a value that cannot be
  std::uint64_t old = 0;         ///< of a period that is over: repeated, overtaken
  std::uint64_t untimely = 0;    ///< not within half a period of when it was due
};

class UdpDevice {
 public:
  /// `address`: [HOST:]PORT to listen at. delay: periods from a sample to the power computed from
  /// it. Waits ten seconds for a program that says hello and sends a sample in each period. Throws
  /// Error; unless `light_allowed` also for a program that is not simulated.
  UdpDevice(const std::string& address, int delay, double period, bool light_allowed);
  ~UdpDevice();
  UdpDevice(const UdpDevice&) = delete;
  UdpDevice& operator=(const UdpDevice&) = delete;

  const std::string& name() const noexcept { return name_; }
  const UdpDrops& drops() const noexcept { return drops_; }
  /// The datagrams that did not come or were not used, in words.
  std::string status() const;

  /// The next period is cycle 0; cycles, samples and tokens are counted anew. Blocks for some
  /// periods, at 0 W, to see when samples are due.
  void begin() noexcept;

  /// Half a period beyond the sample's time at most, and one and a half periods.
  DeviceSample wait_sample(std::uint64_t cycle) noexcept;
  Readback readback() noexcept { return readback_; }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept;
  void heartbeat(std::uint64_t) noexcept {}
  /// From now on the program gets no token.
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
  std::uint64_t next_ = 1;   // period that is waited for
  std::int64_t due_ns_ = 0;  // its end, CLOCK_MONOTONIC
  UdpSample last_;  // that was believed: of a period before `next_`, or waiting for its turn
  std::int64_t last_received_ns_ = 0;
  std::int64_t empty_ns_ = 0;  // nothing was there to receive
  Readback readback_;
  UdpDrops drops_;
  std::uint64_t missing_ = 0;  // periods
  std::uint64_t token_ = 0;
  std::uint64_t samples_before_ = 0;
  std::uint64_t tokens_before_ = 0;
  bool off_ = false;
};
static_assert(Device<UdpDevice>);

}  // namespace photocoag
