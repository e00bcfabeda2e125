#include "photocoag/rt/udp_device.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;  // ns
constexpr std::int64_t kHelloWithin = 10 * kSecond;
constexpr std::int64_t kGoneAfter = kSecond;  // of silence
constexpr int kAnchors = 8;                   // periods
constexpr int kFollowed = 100;                // due times shift by at most 1/100 of a period each
constexpr int kMostBeyond = 128;              // maximum number of datagrams read after the deadline
constexpr int kOffs = 4;                      // datagrams of 0 W, as some may be lost

std::int64_t nanoseconds(const timespec& time) noexcept {
  return time.tv_sec * kSecond + time.tv_nsec;
}

// Between two times of the program, which may have any value.
double ns_between(std::int64_t from, std::int64_t to) noexcept {
  return static_cast<double>(to) - static_cast<double>(from);
}

bool possible(const UdpSample& sample) noexcept {
  return sample.sequence > 0 && !std::isinf(sample.volume_temperature) &&
         std::isfinite(sample.power) && !std::isinf(sample.command) &&
         (sample.flags & ~kUdpFlags) == 0;
}

std::string printable(const std::array<char, 40>& name) {
  std::string text(name.begin(), std::find(name.begin(), name.end(), '\0'));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

// The kernel's time stamp is of the wall clock; only its age is used.
std::int64_t received_ns(msghdr& message, std::int64_t not_before_ns) noexcept {
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);
  const std::int64_t now = monotonic_ns();
  std::int64_t received = now;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(header), sizeof(stamp));
    received = now - (nanoseconds(wall) - nanoseconds(stamp));
  }
  // The wall clock was set in between: the largest possible age.
  if (received > now) return not_before_ns;
  return std::max(received, not_before_ns);
}

}  // namespace

UdpDevice::Socket::~Socket() {
  if (descriptor >= 0) close(descriptor);
}

UdpDevice::UdpDevice(const std::string& address, int delay, double period, bool light_allowed)
    : where_("udp:" + address), delay_(delay), period_ns_(std::llround(period * 1e9)) {
  const auto refuse = [&](std::string problem, std::string found, std::string accepted,
                          std::string key = {}) {
    throw Error(ErrorParts{.where = where_,
                           .key = std::move(key),
                           .problem = std::move(problem),
                           .found = std::move(found),
                           .accepted = std::move(accepted)});
  };
  listen(address);
  const std::int64_t give_up = monotonic_ns() + kHelloWithin;
  const UdpHello hello = await_hello(give_up);
  name_ = printable(hello.name);
  if (hello.head.version != kUdpVersion) {
    refuse("the acquisition program speaks another version of the protocol",
           fmt::format("version {}", hello.head.version), fmt::format("version {}", kUdpVersion));
  }
  if (hello.period_ns != period_ns_) {
    refuse("the acquisition program has another control period",
           fmt::format("{:g} ms", static_cast<double>(hello.period_ns) * 1e-6),
           fmt::format("control.period_ms = {:g}", period * 1e3));
  }
  if (hello.simulated != 1 && !light_allowed) {
    refuse("light can come out of what this program drives", "observe, or no supervisor",
           "\"enforce\", with safety.supervisor = \"on\"", "safety.real_time");
  }
  while (session_ == 0) {
    if (getrandom(&session_, sizeof(session_), 0) != sizeof(session_)) session_ = 0;
  }
  send(UdpKind::kWelcome);
  if (!anchor(give_up)) {
    refuse("the acquisition program does not send a sample in each control period", status(),
           "one datagram per period; docs/devices.md, \"An acquisition program\"");
  }
}

UdpDevice::~UdpDevice() { safe_off(); }

void UdpDevice::listen(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const std::string host = colon == std::string::npos ? "127.0.0.1" : address.substr(0, colon);
  const char* end = address.data() + address.size();
  const char* digits = colon == std::string::npos ? address.data() : address.data() + colon + 1;
  std::uint16_t port = 0;
  const auto read = std::from_chars(digits, end, port);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(port);
  if (read.ec != std::errc() || read.ptr != end || port == 0 ||
      inet_pton(AF_INET, host.c_str(), &own.sin_addr) != 1) {
    throw Error(ErrorParts{.where = "--device",
                           .key = "udp",
                           .found = address,
                           .accepted = "[HOST:]PORT: an IPv4 address of this machine (127.0.0.1 if "
                                       "none is given) and 1 to 65535"});
  }
  socket_.descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  if (socket_.descriptor < 0 ||
      setsockopt(socket_.descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on)) != 0 ||
      bind(socket_.descriptor, reinterpret_cast<const sockaddr*>(&own), sizeof(own)) != 0) {
    throw Error(ErrorParts{.where = where_,
                           .problem = "it cannot be listened at",
                           .found = std::strerror(errno),
                           .accepted = "a port that no other program has, another treatment's for "
                                       "instance, and an address of this machine"});
  }
}

UdpHello UdpDevice::await_hello(std::int64_t give_up_ns) {
  std::uint64_t others = 0;
  Datagram datagram;
  while (monotonic_ns() < give_up_ns && !stop_requested()) {
    if (!receive(datagram)) {
      wait_until_readable(std::min(give_up_ns, monotonic_ns() + kSecond / 10));
      continue;
    }
    UdpHello hello;
    std::memcpy(&hello, datagram.bytes.data(), sizeof(hello));
    peer_ = datagram.from;
    // A later version may be longer.
    const bool magic = datagram.size >= sizeof(UdpHead) && hello.head.magic == kUdpMagic &&
                       hello.head.kind == UdpKind::kHello;
    if (magic && (datagram.size == sizeof(hello) || hello.head.version != kUdpVersion)) {
      return hello;
    }
    ++others;
  }
  throw Error(ErrorParts{
      .where = where_,
      .problem =
          fmt::format("no acquisition program said hello within {} s", kHelloWithin / kSecond),
      .found = others == 0 ? "nothing" : fmt::format("{} datagrams that are no hello", others),
      .accepted = "a program that was started before and sends its hello here, again and again "
                  "until it is welcome; docs/devices.md, \"An acquisition program\""});
}

// Finds when samples are due: the earliest phase of several, as datagrams can only be delayed.
bool UdpDevice::anchor(std::int64_t give_up_ns) noexcept {
  const std::int64_t started = monotonic_ns();
  const std::uint64_t before = last_.sequence;
  std::int64_t earliest = 0;
  int count = 0;
  Datagram datagram;
  while (count < kAnchors) {
    if (!receive(datagram)) {
      if (monotonic_ns() >= give_up_ns) return false;
      wait_until_readable(give_up_ns);
      continue;
    }
    UdpSample sample;
    if (!read(datagram, sample)) {
      if (before == 0 && count == 0) send(UdpKind::kWelcome);  // the first one was lost
      continue;
    }
    if (datagram.received_ns < started) continue;
    if (count > 0 && sample.sequence < next_) {
      ++drops_.old;
      continue;
    }
    if (count > 0 && !timely(sample, datagram.received_ns)) {
      ++drops_.untimely;
      count = 0;
    }
    if (count == 0) {
      next_ = sample.sequence;
      due_ns_ = datagram.received_ns;
      earliest = 0;
    }
    due_ns_ += static_cast<std::int64_t>(sample.sequence - next_) * period_ns_;
    earliest = std::min(earliest, datagram.received_ns - due_ns_);
    keep(sample, datagram.received_ns);
    take_readback();
    next_ = sample.sequence + 1;
    due_ns_ += period_ns_;
    write_power(0.0, token_ + 1);
    ++count;
  }
  due_ns_ += earliest;
  samples_before_ = next_ - 1;
  tokens_before_ += token_;
  token_ = 0;
  return true;
}

void UdpDevice::begin() noexcept { anchor(monotonic_ns() + 8 * kAnchors * period_ns_); }

bool UdpDevice::receive(Datagram& datagram) noexcept {
  iovec part{.iov_base = datagram.bytes.data(), .iov_len = datagram.bytes.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec))] = {};
  msghdr message{};
  message.msg_name = &datagram.from;
  message.msg_namelen = sizeof(datagram.from);
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof(control);
  datagram.bytes.fill(std::byte{0});
  const std::int64_t before = monotonic_ns();
  const ssize_t got = recvmsg(socket_.descriptor, &message, MSG_DONTWAIT | MSG_TRUNC);
  if (got < 0) {
    empty_ns_ = before;
    return false;
  }
  datagram.size = static_cast<std::size_t>(got);  // of the whole datagram, even if it is truncated
  datagram.received_ns = received_ns(message, empty_ns_);
  return true;
}

void UdpDevice::wait_until_readable(std::int64_t deadline_ns) const noexcept {
  const std::int64_t left = std::max<std::int64_t>(0, deadline_ns - monotonic_ns());
  const timespec timeout{.tv_sec = left / kSecond, .tv_nsec = left % kSecond};
  pollfd wait{.fd = socket_.descriptor, .events = POLLIN, .revents = 0};
  ppoll(&wait, 1, &timeout, nullptr);
}

// True if it is a plausible sample of this program.
bool UdpDevice::read(const Datagram& datagram, UdpSample& sample) noexcept {
  if (datagram.from.sin_addr.s_addr != peer_.sin_addr.s_addr ||
      datagram.from.sin_port != peer_.sin_port) {
    ++drops_.foreign;
    return false;
  }
  std::memcpy(&sample, datagram.bytes.data(), sizeof(sample));
  const UdpHead& head = sample.head;
  if (datagram.size != sizeof(sample) || head.magic != kUdpMagic || head.version != kUdpVersion ||
      head.kind != UdpKind::kSample || head.session != session_) {
    ++drops_.unreadable;
    return false;
  }
  if (possible(sample)) return true;
  ++drops_.impossible;
  return false;
}

// True if it arrived at the end of its period by our clock and its distance to the last sample is
// right by the program's.
bool UdpDevice::timely(const UdpSample& sample, std::int64_t received) const noexcept {
  const auto period = static_cast<double>(period_ns_);
  const auto periods_since = [&](std::uint64_t sequence) {
    return static_cast<double>(static_cast<std::int64_t>(sample.sequence - sequence));
  };
  const double ours = ns_between(due_ns_, received) - periods_since(next_) * period;
  const double theirs =
      ns_between(last_.time_ns, sample.time_ns) - periods_since(last_.sequence) * period;
  return std::abs(ours) <= period / 2 && std::abs(theirs) <= period / 2;
}

void UdpDevice::keep(const UdpSample& sample, std::int64_t received) noexcept {
  last_ = sample;
  last_received_ns_ = received;
}

void UdpDevice::take_readback() noexcept {
  readback_ = {.power = last_.power,
               .command = last_.command,
               .interlock_closed = (last_.flags & kUdpInterlockClosed) != 0,
               .shutter_open = (last_.flags & kUdpShutterOpen) != 0,
               .foot_switch = (last_.flags & kUdpFootSwitch) != 0};
}

DeviceSample UdpDevice::wait_sample(std::uint64_t) noexcept {
  const std::int64_t deadline =
      std::min(due_ns_ + period_ns_ / 2, monotonic_ns() + period_ns_ * 3 / 2);
  Datagram datagram;
  for (int beyond = 0; last_.sequence < next_ && beyond < kMostBeyond;) {
    const bool over = monotonic_ns() >= deadline;
    if (!receive(datagram)) {
      if (over) break;
      wait_until_readable(deadline);
      continue;
    }
    beyond += over ? 1 : 0;
    UdpSample sample;
    if (!read(datagram, sample)) continue;
    if (sample.sequence < next_) {
      ++drops_.old;
    } else if (!timely(sample, datagram.received_ns)) {
      ++drops_.untimely;
    } else {
      keep(sample, datagram.received_ns);
    }
  }
  const bool there = last_.sequence == next_;
  const std::int64_t now = monotonic_ns();
  const std::int64_t behind = std::max<std::int64_t>(0, now - due_ns_) / period_ns_;
  DeviceSample sample;
  sample.periods_behind = static_cast<std::uint32_t>(std::min<std::int64_t>(behind, 1'000'000));
  sample.sequence = next_ - samples_before_;
  sample.time_ns = there ? last_received_ns_ : due_ns_;
  sample.now_ns = now;
  if (there) {
    sample.status = DeviceStatus::kGood;
    sample.saturated = (last_.flags & kUdpSaturated) != 0;
    sample.stop_asked = (last_.flags & kUdpStopAsked) != 0;
    sample.raw = last_.raw;
    if (behind == 0) sample.volume_temperature = last_.volume_temperature;
    take_readback();
    // The due times follow the drift of the program's clock.
    const std::int64_t most = period_ns_ / kFollowed;
    due_ns_ += std::clamp(last_received_ns_ - due_ns_, -most, most);
  } else {
    ++missing_;
    if (now - last_received_ns_ > kGoneAfter) sample.status = DeviceStatus::kGone;
    readback_.power = readback_.command = std::numeric_limits<double>::quiet_NaN();
  }
  ++next_;
  due_ns_ += period_ns_;
  return sample;
}

bool UdpDevice::send(UdpKind kind, double power, std::uint64_t token) const noexcept {
  const UdpAnswer answer{.head = {.kind = kind, .session = session_},
                         .period = next_ + static_cast<std::uint64_t>(delay_),
                         .token = token,
                         .power = power};
  return sendto(socket_.descriptor, &answer, sizeof(answer), MSG_DONTWAIT | MSG_NOSIGNAL,
                reinterpret_cast<const sockaddr*>(&peer_), sizeof(peer_)) == sizeof(answer);
}

DeviceStatus UdpDevice::write_power(double power, std::uint64_t token) noexcept {
  if (off_) {
    send(UdpKind::kOff);
    return power == 0.0 ? DeviceStatus::kGood : DeviceStatus::kTimeout;
  }
  if (token <= token_) return DeviceStatus::kTimeout;  // an old token does not count
  token_ = token;
  const bool sent = send(UdpKind::kPower, power, tokens_before_ + token);
  return sent ? DeviceStatus::kGood : DeviceStatus::kTimeout;
}

void UdpDevice::safe_off() noexcept {
  off_ = true;
  if (session_ == 0) return;  // no program yet
  for (int i = 0; i < kOffs; ++i) send(UdpKind::kOff);
}

std::string UdpDevice::status() const {
  return fmt::format(
      "{} periods without a sample; datagrams dropped: {} foreign, {} unreadable, {} impossible, "
      "{} old, {} untimely",
      missing_, drops_.foreign, drops_.unreadable, drops_.impossible, drops_.old, drops_.untimely);
}

}  // namespace photocoag
