// The desk's functions for the operator of a session.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "photocoag/console/desk.hpp"

namespace photocoag {
namespace {

// Words and names without characters that JSON would escape.
std::string list_of(const std::vector<std::string>& words) {
  std::string list;
  for (const std::string& word : words)
    list += fmt::format("{}\"{}\"", list.empty() ? "" : ",", word);
  return list;
}

bool holds(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

std::string Desk::role_message() const {
  return fmt::format(
      R"({{"type":"role","operator":{},"clients":{},"choices":[{}],"run_on":{},"spots":[{}]}})",
      operator_, clients_, list_of(choices_), run_on_, list_of(spots_));
}

void Desk::set_before(std::string message) {
  const std::lock_guard lock(mutex_);
  if (settings_.before == message) return;
  settings_.before = std::move(message);
  pending_.push_back(settings_.before);
  if (!self_test_.empty()) pending_.push_back(self_test_);
}

void Desk::offer(std::vector<std::string> choices, std::vector<std::string> spots) {
  const std::lock_guard lock(mutex_);
  if (wish_ == Wish::kChoice) wish_ = Wish::kNone;
  if (choices_ == choices && spots_ == spots) return;
  choices_ = std::move(choices);
  spots_ = std::move(spots);
  pending_.push_back(role_message());
}

// Empty on success, else the reason.
std::string Desk::choose(std::string_view command) {
  if (command == "run_on" || command == "run_off") {
    if (!settings_.browser_starts) {
      return "a device is started at the terminal, not by a browser";
    }
    if (session_.empty()) return "there is no session";
    run_on_ = command == "run_on";
    // Not while a spot runs or begins: it may just have been stopped.
    if (run_on_ && !committed_ && state_ != SafetyState::kTreating) settings_.resume();
    pending_.push_back(role_message());
    return {};
  }
  const std::size_t space = command.find(' ');
  if (!holds(choices_, command.substr(0, space))) return "not now";
  if (space == std::string_view::npos && command == "repeat" && !spots_.empty()) {
    return "which spot?";
  }
  if (space != std::string_view::npos && !holds(spots_, command.substr(space + 1))) {
    return "no such spot";
  }
  wish_ = Wish::kChoice;
  choice_ = command;
  wished_.notify_one();
  return {};
}

std::string Desk::choice() const {
  const std::lock_guard lock(mutex_);
  return choice_;
}

bool Desk::runs_on() const {
  const std::lock_guard lock(mutex_);
  return run_on_;
}

void Desk::end_run_on() {
  const std::lock_guard lock(mutex_);
  if (std::exchange(run_on_, false)) pending_.push_back(role_message());
}

bool Desk::commit() {
  const std::lock_guard lock(mutex_);
  return committed_ = run_on_ || starter_ != Starter::kNobody;
}

void Desk::rest() {
  const std::lock_guard lock(mutex_);
  if (state_ == SafetyState::kStandby || state_ == SafetyState::kReady) {
    set(SafetyState::kOff, SafetyReason::kNone);
  }
}

void Desk::tell_session(std::string message) {
  const std::lock_guard lock(mutex_);
  session_ = std::move(message);
  session_told_ = false;
}

void Desk::set_folders(std::vector<std::filesystem::path> folders) {
  const std::lock_guard lock(mutex_);
  folders_ = std::move(folders);
}

}  // namespace photocoag
