#include "photocoag/realtime_check/doctor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <thread>

#include "photocoag/rt/real_time.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

/// First line without trailing blanks; nullopt if there is no such file.
std::optional<std::string> line_of(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  if (!stream || !std::getline(stream, line)) return {};
  line.erase(line.find_last_not_of(" \t\r\n") + 1);
  return line;
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

Finding kernel(const fs::path& root) {
  const std::string version = line_of(root / "proc/version").value_or("unknown");
  const bool real_time = line_of(root / "sys/kernel/realtime").value_or("0") == "1" ||
                         version.find("PREEMPT_RT") != std::string::npos;
  if (real_time) return {"kernel", Health::kGood, "PREEMPT_RT", ""};
  const bool preempt = version.find("PREEMPT") != std::string::npos;
  return {"kernel", Health::kBad,
          preempt ? "no PREEMPT_RT (preemptible, ordinary kernel)" : "no PREEMPT_RT",
          "install a real-time kernel (Debian: linux-image-rt-amd64) and boot it"};
}

Finding governor(const fs::path& root) {
  std::set<std::string> governors;
  std::error_code error;
  for (const auto& cpu : fs::directory_iterator(root / "sys/devices/system/cpu", error)) {
    if (const auto name = line_of(cpu.path() / "cpufreq/scaling_governor")) governors.insert(*name);
  }
  if (governors.empty()) {
    return {"cpu frequency", Health::kWarn, "no frequency control visible",
            "on a physical machine: is it disabled in the firmware?"};
  }
  std::string found;
  for (const std::string& name : governors) found += (found.empty() ? "" : ", ") + name;
  if (governors == std::set<std::string>{"performance"}) {
    return {"cpu frequency", Health::kGood, found, ""};
  }
  return {"cpu frequency", Health::kWarn, found,
          "cpupower frequency-set -g performance: changing the clock costs tens of microseconds"};
}

Finding idle(const fs::path& root) {
  constexpr int kSlow = 50;  // us
  int worst = -1;
  std::error_code error;
  for (const auto& state :
       fs::directory_iterator(root / "sys/devices/system/cpu/cpu0/cpuidle", error)) {
    if (line_of(state.path() / "disable").value_or("0") == "1") continue;
    const std::string latency = line_of(state.path() / "latency").value_or("0");
    int value = 0;
    std::from_chars(latency.data(), latency.data() + latency.size(), value);
    worst = std::max(worst, value);
  }
  if (worst < 0) return {"idle states", Health::kGood, "none to be seen", ""};
  if (worst <= kSlow) {
    return {"idle states", Health::kGood, fmt::format("wake up in {} us", worst), ""};
  }
  return {"idle states", Health::kWarn, fmt::format("the deepest needs {} us to wake up", worst),
          "boot with intel_idle.max_cstate=1 processor.max_cstate=1, or hold /dev/cpu_dma_latency"};
}

Finding isolated(const fs::path& root) {
  const std::string cpus = line_of(root / "sys/devices/system/cpu/isolated").value_or("");
  if (!cpus.empty()) return {"isolated cores", Health::kGood, cpus, ""};
  return {"isolated cores", Health::kWarn, "none",
          "boot with isolcpus=N nohz_full=N rcu_nocbs=N and set safety.core = N"};
}

Finding cores(const fs::path& root) {
  const std::string text = text_of(root / "proc/cpuinfo");
  int count = 0;
  for (std::size_t at = text.find("processor"); at != std::string::npos;
       at = text.find("processor", at + 1)) {
    count += at == 0 || text[at - 1] == '\n' ? 1 : 0;
  }
  const bool threads = line_of(root / "sys/devices/system/cpu/smt/active").value_or("0") == "1";
  const std::string found = fmt::format("{}{}", count, threads ? ", two threads on each" : "");
  if (count < 2) {
    return {"cores", Health::kBad, found, "the loop needs its own core besides the system's"};
  }
  if (threads) {
    return {"cores", Health::kWarn, found, "switch off simultaneous multithreading (nosmt)"};
  }
  return {"cores", Health::kGood, found, ""};
}

Finding clocksource(const fs::path& root) {
  const std::string name =
      line_of(root / "sys/devices/system/clocksource/clocksource0/current_clocksource")
          .value_or("unknown");
  if (name == "tsc") return {"clock source", Health::kGood, name, ""};
  if (name == "kvm-clock" || name == "arch_sys_counter") {
    return {"clock source", name == "kvm-clock" ? Health::kWarn : Health::kGood, name,
            name == "kvm-clock" ? "a guest's clock: measure on the machine itself" : ""};
  }
  return {"clock source", Health::kBad, name,
          "tsc is read in nanoseconds, others in microseconds: look for its failure in dmesg"};
}

Finding hypervisor(const fs::path& root) {
  const std::string text = text_of(root / "proc/cpuinfo");
  const std::size_t flags = text.find("\nflags");
  const std::string line =
      flags == std::string::npos ? "" : text.substr(flags, text.find('\n', flags + 1) - flags);
  if (line.find(" hypervisor") == std::string::npos) {
    return {"hypervisor", Health::kGood, "none", ""};
  }
  return {"hypervisor", Health::kBad, "this is a virtual machine",
          "its host may take the processor away at any time: use a physical machine"};
}

Finding interrupts_of_the_firmware(const fs::path& root) {
  // MSR 0x34 counts system management interrupts since power on (Intel).
  const int file = ::open((root / "dev/cpu/0/msr").c_str(), O_RDONLY | O_CLOEXEC);
  std::uint64_t count = 0;
  const bool known = file >= 0 && ::pread(file, &count, sizeof(count), 0x34) == sizeof(count);
  if (file >= 0) ::close(file);
  if (!known) {
    return {"firmware interrupts", Health::kWarn, "not known (SMI counter cannot be read)",
            "as root: modprobe msr; or hwlatdetect of rt-tests for an hour"};
  }
  return {"firmware interrupts", count == 0 ? Health::kGood : Health::kWarn,
          fmt::format("{} SMI since power on", count),
          count == 0 ? "" : "if they grow: legacy USB and power management off in the firmware"};
}

Finding throttling(const fs::path& root) {
  const std::string runtime =
      line_of(root / "proc/sys/kernel/sched_rt_runtime_us").value_or("unknown");
  if (runtime == "-1") return {"real-time throttling", Health::kGood, "off", ""};
  return {"real-time throttling", Health::kWarn,
          runtime == "unknown" ? runtime : runtime + " us of every second may be real time",
          "harmless below 95 % load; sysctl kernel.sched_rt_runtime_us=-1 switches it off"};
}

Finding swap(const fs::path& root) {
  const std::string text = text_of(root / "proc/swaps");
  const bool used = std::count(text.begin(), text.end(), '\n') > 1;
  if (!used) return {"swap", Health::kGood, "none", ""};
  return {"swap", Health::kWarn, "in use", "harmless while memory is locked; swapoff -a"};
}

std::string limit(std::uint64_t value, std::string_view unit) {
  return value == UINT64_MAX ? "unlimited" : fmt::format("{}{}", value, unit);
}

Finding priority(const Privileges& privileges) {
  const std::string found = fmt::format("{}; limit {}", privileges.fifo ? "granted" : "refused",
                                        limit(privileges.rt_priority_limit, ""));
  if (privileges.fifo) return {"SCHED_FIFO", Health::kGood, found, ""};
  return {"SCHED_FIFO", Health::kBad, found,
          "/etc/security/limits.d: @realtime - rtprio 90 (then log in again)"};
}

Finding memory(const Privileges& privileges) {
  const std::string found = fmt::format("{}; limit {}", privileges.locked ? "granted" : "refused",
                                        limit(privileges.locked_bytes_limit, " bytes"));
  if (privileges.locked) return {"locked memory", Health::kGood, found, ""};
  return {"locked memory", Health::kBad, found,
          "/etc/security/limits.d: @realtime - memlock unlimited"};
}

}  // namespace

Privileges own_privileges() {
  RealTime granted;
  std::thread([&granted] { granted = request_real_time(); }).join();
  const auto soft = [](auto resource) -> std::uint64_t {
    rlimit value{};
    if (getrlimit(resource, &value) != 0) return 0;
    return value.rlim_cur == RLIM_INFINITY ? UINT64_MAX : value.rlim_cur;
  };
  return {.fifo = granted.fifo_priority,
          .locked = granted.locked_memory,
          .rt_priority_limit = soft(RLIMIT_RTPRIO),
          .locked_bytes_limit = soft(RLIMIT_MEMLOCK)};
}

std::vector<Finding> examine(const Privileges& privileges, const fs::path& root) {
  return {kernel(root),       hypervisor(root), priority(privileges),
          memory(privileges), cores(root),      isolated(root),
          governor(root),     idle(root),       clocksource(root),
          throttling(root),   swap(root),       interrupts_of_the_firmware(root)};
}

}  // namespace photocoag
