// Role: setup; finds what on this machine impairs real-time operation. Used by `doctor`, console.
// Source: docs/realtime.md. Reads /proc and /sys, changes nothing but the measuring thread's own
// scheduling.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

enum class Health : std::uint8_t { kGood, kWarn, kBad };

constexpr std::string_view to_string(Health health) noexcept {
  constexpr std::string_view names[] = {"good", "warn", "bad"};
  return names[static_cast<std::size_t>(health)];
}

struct Finding {
  std::string topic;
  Health health = Health::kGood;
  std::string found;
  std::string advice;  ///< empty if good
};

/// Privileges of the process; limits of UINT64_MAX mean unlimited.
struct Privileges {
  bool fifo = false;
  bool locked = false;
  std::uint64_t rt_priority_limit = 0;
  std::uint64_t locked_bytes_limit = 0;
};

/// Privileges of this process, tested on a separate thread.
Privileges own_privileges();

/// `root`: folder of proc/, sys/ and dev/, replaced in tests. A missing file is a finding, not an
/// error.
std::vector<Finding> examine(const Privileges& privileges, const std::filesystem::path& root = "/");

}  // namespace photocoag
