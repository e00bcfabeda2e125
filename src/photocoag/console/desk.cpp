#include "photocoag/console/desk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <utility>

#include "photocoag/console/messages.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

constexpr double kRingSeconds = 2.0;           // that the server may stall without losing a row
constexpr std::size_t kLeastRing = 1024;       // records
constexpr std::size_t kMostReport = 32 << 20;  // bytes

std::size_t ring_size(double period) {
  return std::max(kLeastRing, static_cast<std::size_t>(kRingSeconds / period));
}

// Words of a session's choices; "repeat" may name a spot.
bool is_choice(std::string_view command) {
  constexpr std::string_view kChoices[] = {"accept",   "repeat", "skip",   "end",
                                           "continue", "run_on", "run_off"};
  const std::string_view word = command.substr(0, command.find(' '));
  return std::ranges::find(kChoices, word) != std::end(kChoices);
}

// When a cycle's sample was taken, ns since 1970; in virtual time the time of reading.
std::int64_t unix_ns_of(const LogRecord& record) {
  using namespace std::chrono;
  const std::int64_t now =
      duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
  constexpr std::int64_t kOldest = 10'000'000'000;  // ns
  const std::int64_t age = monotonic_ns() - record.end.sample.now_ns;
  return age >= 0 && age < kOldest ? now - age : now;
}

struct RunFile {
  std::string_view name;
  const char* type;
};
constexpr RunFile kRunFiles[] = {{"report.html", "text/html; charset=utf-8"},
                                 {"run.csv", "text/csv; charset=utf-8"},
                                 {"summary.json", "application/json"},
                                 {"config.toml", "text/plain; charset=utf-8"}};

}  // namespace

Desk::Desk(DeskSettings settings)
    : settings_(std::move(settings)), ring_(ring_size(settings_.period)), batch_(512) {}

ServerHooks Desk::hooks(std::function<std::optional<WebFile>(std::string_view)> page,
                        std::function<void(std::string_view)> log) {
  return {.came = [this](int client) { return came(client); },
          .said = [this](int client, std::string_view text) { return answer(client, text); },
          .left = [this](int client) { left(client); },
          .tick = [this] { return tick(); },
          .file = std::move(page),
          .run_file = [this](std::string_view path) { return run_file(path); },
          .log = std::move(log),
          .foxglove = settings_.foxglove ? &foxglove_ : nullptr};
}

SafetyState Desk::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Desk::set(SafetyState state, SafetyReason reason) {
  state_ = state;
  reason_ = reason;
}

void Desk::self_tested(const SelfTestReport& report, const SafetyLimits& limits) {
  Supervisor judge(limits, {});
  judge.power_on();
  const bool passed = judge.finish_self_test(report);
  const std::lock_guard lock(mutex_);
  self_test_ = self_test_message(report, limits);
  pending_.push_back(self_test_);
  if (state_ == SafetyState::kTreating) return;  // the spot's own, before its loop
  set(passed ? SafetyState::kStandby : SafetyState::kSafeStop,
      passed ? SafetyReason::kNone : SafetyReason::kSelfTest);
}

void Desk::stand_by() {
  const std::lock_guard lock(mutex_);
  set(SafetyState::kStandby, SafetyReason::kNone);
}

Desk::Wish Desk::wait(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  wished_.wait_for(lock, patience, [this] { return wish_ != Wish::kNone; });
  return std::exchange(wish_, Wish::kNone);
}

void Desk::enter() {
  const std::lock_guard lock(mutex_);
  if (state_ == SafetyState::kStandby || state_ == SafetyState::kReady) {
    settings_.resume();
    wish_ = Wish::kStart;
    starter_ = Starter::kTerminal;
  } else if (state_ != SafetyState::kTreating && state_ != SafetyState::kSelfTest) {
    wish_ = Wish::kReset;
  }
  wished_.notify_one();
}

void Desk::begin(const SpotBegin& spot) {
  const std::lock_guard lock(mutex_);
  spot_ = spot;
  starter_ = Starter::kNobody;
  committed_ = false;
  last_spot_.clear();
  set(SafetyState::kTreating, SafetyReason::kNone);
}

void Desk::over(SafetyState state, SafetyReason reason) {
  const std::lock_guard lock(mutex_);
  wish_ = Wish::kNone;
  set(state, reason);
}

void Desk::end(SpotEnd spot) {
  const std::lock_guard lock(mutex_);
  if (folders_.size() < static_cast<std::size_t>(spot_.number)) {
    folders_.push_back(std::move(spot.folder));
  }
  last_spot_ = std::move(spot.message);
  pending_.push_back(last_spot_);
  if (state_ == SafetyState::kTreating) set(spot.state, spot.reason);
}

std::vector<std::string> Desk::came(int client) {
  const std::lock_guard lock(mutex_);
  ++clients_;
  if (operator_ == 0) operator_ = client;
  std::vector<std::string> messages = {hello_message(client)};
  if (!settings_.before.empty()) messages.push_back(settings_.before);
  if (!session_.empty()) messages.push_back(session_);
  if (!self_test_.empty()) messages.push_back(self_test_);
  if (!last_spot_.empty()) messages.push_back(last_spot_);
  pending_.push_back(role_message());
  return messages;
}

void Desk::left(int client) {
  const std::lock_guard lock(mutex_);
  --clients_;
  if (operator_ == client) {
    operator_ = 0;
    // No start without an operator; a running spot continues under its supervisor.
    nothing_starts(settings_.browser_starts);
  }
  pending_.push_back(role_message());
}

// Cancels what is armed, started or running on but has not begun.
void Desk::nothing_starts(bool of_terminal) {
  if (state_ == SafetyState::kReady) set(SafetyState::kStandby, SafetyReason::kNone);
  run_on_ = false;
  if (!of_terminal && starter_ == Starter::kTerminal) return;
  starter_ = Starter::kNobody;
  if (wish_ == Wish::kStart || of_terminal) wish_ = Wish::kNone;
}

std::string Desk::answer(int client, std::string_view text) {
  const std::optional<std::string> command = command_of(text);
  if (!command) return {};
  const std::lock_guard lock(mutex_);
  return answer_message(*command, obey(client, *command));
}

// Empty on success, else the reason.
std::string Desk::obey(int client, std::string_view command) {
  if (command == "stop") {
    settings_.stop();
    wish_ = Wish::kNone;
    if (std::exchange(run_on_, false)) pending_.push_back(role_message());
    nothing_starts(true);
    return {};
  }
  if (command == "operate") {
    if (operator_ != 0 && operator_ != client) return "another tab operates";
    operator_ = client;
    pending_.push_back(role_message());
    return {};
  }
  constexpr std::string_view kOperators[] = {"release", "arm", "disarm", "start", "reset"};
  const bool plain = std::ranges::find(kOperators, command) != std::end(kOperators);
  if (!plain && !is_choice(command)) return "no such command";
  if (operator_ != client) return "this tab only watches";
  if (command == "release") {
    operator_ = 0;
    nothing_starts(false);
    pending_.push_back(role_message());
    return {};
  }
  if (!plain) return choose(command);
  if (!settings_.browser_starts) return "a device is started at the terminal, not by a browser";
  return refusal(command);
}

// Commands reserved for the operator of a simulated eye.
std::string Desk::refusal(std::string_view command) {
  const auto step = [&](SafetyState from, SafetyState to) -> std::string {
    if (state_ != from) return fmt::format("not in {}", to_string(state_));
    set(to, SafetyReason::kNone);
    return {};
  };
  if (committed_) return "a spot begins";
  if (command == "arm") {
    std::string why = step(SafetyState::kStandby, SafetyState::kReady);
    if (why.empty()) settings_.resume();
    return why;
  }
  if (command == "disarm") {
    starter_ = Starter::kNobody;
    return step(SafetyState::kReady, SafetyState::kStandby);
  }
  const bool over = state_ == SafetyState::kDone || state_ == SafetyState::kSafeStop;
  if (command == "start" ? state_ != SafetyState::kReady : !over) {
    return fmt::format("not in {}", to_string(state_));
  }
  wish_ = command == "start" ? Wish::kStart : Wish::kReset;
  if (command == "start") starter_ = Starter::kBrowser;
  wished_.notify_one();
  return {};
}

std::vector<std::string> Desk::tick() {
  std::vector<std::string> messages(1);
  std::vector<std::string> after;
  std::string rows;
  bool someone = false;
  int spot = 0;
  {
    const std::lock_guard lock(mutex_);
    after = std::exchange(pending_, {});
    if (!std::exchange(session_told_, true)) after.push_back(session_);
    someone = clients_ > 0;
    spot = spot_.number;
  }
  if (rows_of_ != spot) {
    rows_of_ = spot;
    newest_ = {};
    next_cycle_ = dropped_ = overruns_ = 0;
  }
  // The ring now holds everything that the loop wrote before `after`.
  for (std::size_t count; (count = ring_.pop(batch_)) > 0;) {
    for (std::size_t i = 0; i < count; ++i) {
      newest_ = batch_[i];
      dropped_ += newest_.cycle - next_cycle_;
      next_cycle_ = newest_.cycle + 1;
      overruns_ += newest_.overrun ? 1 : 0;
      if (foxglove_.wanted()) foxglove_.add(newest_, unix_ns_of(newest_));
      if (!someone) continue;
      if (!rows.empty()) rows += ',';
      append_row(rows, newest_);
    }
  }
  messages.front() = live_message(std::move(rows));
  messages.insert(messages.end(), std::make_move_iterator(after.begin()),
                  std::make_move_iterator(after.end()));
  return messages;
}

std::string Desk::live_message(std::string rows) {
  const std::lock_guard lock(mutex_);
  const bool treating = state_ == SafetyState::kTreating;
  const bool any = next_cycle_ > 0;
  const double power = treating && any ? newest_.end.next_power : 0.0;
  const SafetyStatus& safety = newest_.end.safety;
  const double age = static_cast<double>(monotonic_ns() - newest_.end.sample.now_ns) * 1e-6;
  // After the last cycle no more rows are due.
  const bool due = treating && any && safety.state == SafetyState::kTreating &&
                   newest_.wake_late != LogRecord::kNoTime;
  return fmt::format(
      R"({{"type":"live","state":"{}","reason":"{}","spot":{},"emission":{},"power_W":{},)"
      R"("cycle":{},"planned_cycles":{},"energy_J":{},"exposure_s":{},"thermal_dose":{},)"
      R"("detections":{},"overruns":{},"dropped":{},"age_ms":{},"rows":[{}]}})",
      to_string(state_), to_string(reason_), spot_.number, power > 0.0, json_number(power),
      any ? next_cycle_ : 0, spot_.planned_cycles, json_number(safety.energy),
      json_number(safety.exposure), json_number(safety.dose), safety.detections, overruns_,
      dropped_, due ? json_number(age) : "null", rows);
}

std::optional<WebFile> Desk::run_file(std::string_view path) const {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(path.data(), path.data() + path.size(), number);
  const std::string_view rest(end, static_cast<std::size_t>(path.data() + path.size() - end));
  const auto* const file = std::ranges::find_if(
      kRunFiles, [&](const RunFile& f) { return rest.size() > 1 && rest.substr(1) == f.name; });
  if (error != std::errc() || file == std::end(kRunFiles) || rest.front() != '/') return {};
  std::filesystem::path folder;
  {
    const std::lock_guard lock(mutex_);
    if (number == 0 || number > folders_.size()) return {};
    folder = folders_[number - 1];
  }
  try {
    return WebFile{.type = file->type,
                   .content = read_file((folder / file->name).string(), kMostReport),
                   .page = false};
  } catch (const Error&) {
    return {};  // not written: the disk is full
  }
}

}  // namespace photocoag
