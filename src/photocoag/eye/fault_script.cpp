#include "photocoag/eye/fault_script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <sstream>
#include <string_view>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

constexpr std::uint64_t kPermanent = std::uint64_t{1} << 40;

const std::map<std::string, ScriptedFault, std::less<>>& known_faults() {
  static const std::map<std::string, ScriptedFault, std::less<>> list = {
      {"M1", {EyeFault::kMissing, 0, 1, 0.0}},
      {"M2", {EyeFault::kMissing, 0, 3, 0.0}},
      {"M3", {EyeFault::kOld, 0, 1, 0.0}},
      {"M4", {EyeFault::kStuck, 0, kPermanent, 0.0}},
      {"M5", {EyeFault::kNotANumber, 0, 3, 0.0}},
      {"M6", {EyeFault::kRail, 0, 2, 0.0}},
      {"M7", {EyeFault::kSpike, 0, 3, 25.0}},
      {"M8", {EyeFault::kNoise, 0, kPermanent, 4.0}},
      {"M9", {EyeFault::kFuture, 0, 1, 0.0}},
      {"A1", {EyeFault::kReadback, 0, kPermanent, 1.5}},
      {"A2", {EyeFault::kStuckOn, 0, kPermanent, 0.02}},
      {"A3", {EyeFault::kDeaf, 0, kPermanent, 0.0}},
      {"A4", {EyeFault::kVanish, 0, kPermanent, 0.0}},
      {"A5", {EyeFault::kSwitch, 0, kPermanent, 0.0}},
      {"T1", {EyeFault::kLate, 0, 1, 2.0}},
  };
  return list;
}

template <typename T>
bool read(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

ScriptedFault parse_fault(const std::string& text, const std::string& where) {
  const auto refuse = [&](std::string problem) -> void {
    std::string ids;
    for (const auto& [id, fault] : known_faults()) ids += (ids.empty() ? "" : " ") + id;
    throw Error(ErrorParts{.where = where,
                           .problem = std::move(problem),
                           .found = text.substr(0, 80),
                           .accepted = "ID@cycle[+count][*value] with ID one of " + ids});
  };
  std::string_view rest = text;
  const auto cut = [&rest](char before) {
    const std::size_t at = rest.rfind(before);
    if (at == std::string_view::npos) return std::string_view();
    const std::string_view tail = rest.substr(at + 1);
    rest = rest.substr(0, at);
    return tail;
  };
  const bool has_value = text.find('*') != std::string::npos;
  const std::string_view value = cut('*');
  const bool has_count = rest.find('+') != std::string_view::npos;
  const std::string_view count = cut('+');
  const std::string_view cycle = cut('@');
  const auto known = known_faults().find(rest);
  if (known == known_faults().end()) refuse("no such fault of a device");
  ScriptedFault fault = known->second;
  if (!read(cycle, fault.start) || fault.start >= kPermanent) refuse("no cycle");
  if (has_count && (!read(count, fault.count) || fault.count == 0 || fault.count > kPermanent)) {
    refuse("a bad count");
  }
  if (has_value && (!read(value, fault.value) || !(fault.value >= -1e6 && fault.value <= 1e6))) {
    refuse("a bad value");
  }
  return fault;
}

bool takes_wall_time(const ScriptedFault& fault) noexcept {
  return fault.fault == EyeFault::kLate || fault.fault == EyeFault::kVanish;
}

bool FaultScript::takes_wall_time() const noexcept {
  const std::size_t count = count_.load(std::memory_order_acquire);
  return std::any_of(faults_.begin(), faults_.begin() + static_cast<std::ptrdiff_t>(count),
                     [](const ScriptedFault& fault) { return photocoag::takes_wall_time(fault); });
}

bool FaultScript::add(const ScriptedFault& fault) noexcept {
  const std::size_t count = count_.load(std::memory_order_relaxed);
  if (count == kMost) return false;
  faults_[count] = fault;
  count_.store(count + 1, std::memory_order_release);
  return true;
}

const ScriptedFault* FaultScript::active(EyeFault fault, std::uint64_t cycle) const noexcept {
  const std::size_t count = count_.load(std::memory_order_acquire);
  for (std::size_t i = 0; i < count; ++i) {
    const ScriptedFault& f = faults_[i];
    if (f.fault == fault && cycle >= f.start && cycle - f.start < f.count) return &f;
  }
  return nullptr;
}

void add_faults(const std::string& text_or_file, FaultScript& script) {
  const auto add = [&](const std::string& text, const std::string& where) {
    if (script.add(parse_fault(text, where))) return;
    throw Error(ErrorParts{.where = where,
                           .problem = "too many faults",
                           .accepted = fmt::format("at most {}", FaultScript::kMost)});
  };
  if (text_or_file.find('@') != std::string::npos ||
      !std::filesystem::is_regular_file(text_or_file)) {
    return add(text_or_file, "--fault");
  }
  std::istringstream lines(read_file(text_or_file, 1'000'000, "fault script"));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line = line.substr(0, line.find('#'));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos) continue;
    line = line.substr(first, line.find_last_not_of(" \t\r") - first + 1);
    add(line, fmt::format("{}:{}", text_or_file, number));
  }
}

}  // namespace photocoag
