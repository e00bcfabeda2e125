#include "photocoag/session/session_journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <nlohmann/json.hpp>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t kSum = 16;  // digits of a line's checksum
constexpr std::size_t kMostBytes = 256'000'000;

std::string checksum(const std::string& text) { return sha256_hex(text).substr(0, kSum); }

double system_seconds() {
  using namespace std::chrono;
  return duration<double>(system_clock::now().time_since_epoch()).count();
}

// Syncs the directory entry too.
void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const Descriptor handle(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (handle.open()) fsync(handle.number());
}

std::string line_of(Json json, const std::string& event) {
  json["event"] = event;
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace

SpotEnding SpotHistory::ending() const noexcept {
  if (skipped) return SpotEnding::kSkipped;
  return attempts.empty() ? SpotEnding::kPlanned : attempts.back().ending;
}

SessionJournal::SessionJournal(const std::filesystem::path& file, const Session& session)
    : name_(file.string()),
      file_(open(name_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644)),
      spots_(session.spots.size()) {
  for (const SpotPlan& spot : session.spots) names_.push_back(spot.name);
  if (!file_.open()) fail_by_errno(name_, "cannot be opened");
  if (!file_.lock()) {
    throw Error(ErrorParts{.where = name_,
                           .problem = "another process runs this session",
                           .accepted = "one at a time in a folder"});
  }
  read(session);
  sync_folder(file);
}

void SessionJournal::read(const Session& session) {
  const std::string content = read_file(name_, kMostBytes);
  std::size_t good = 0;
  for (std::size_t end; (end = content.find('\n', good)) != std::string::npos; good = end + 1) {
    const std::string line = content.substr(good, end - good);
    const bool whole = line.size() > kSum + 1 && line[kSum] == ' ' &&
                       line.substr(0, kSum) == checksum(line.substr(kSum + 1));
    if (whole) {
      apply(line.substr(kSum + 1), session);
      continue;
    }
    // The last line may be what a crash of the machine has left.
    if (end + 1 == content.size()) break;
    throw Error(ErrorParts{.where = name_,
                           .problem = "a line is damaged: what was emitted is not known",
                           .accepted = "the journal as it was written, or a new folder"});
  }
  if (ftruncate(file_.number(), static_cast<off_t>(good)) != 0 ||
      lseek(file_.number(), static_cast<off_t>(good), SEEK_SET) < 0) {
    fail_by_errno(name_, "cannot be written");
  }
  if (good == 0) {
    append(line_of({{"identity", session.identity()}}, "session"));
    return;
  }
  continued_ = true;
}

void SessionJournal::apply(const std::string& line, const Session& session) {
  const Json json = Json::parse(line, nullptr, false);
  const auto text = [&](const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_string()
               ? json[key].get<std::string>()
               : std::string();
  };
  const std::string event = text("event");
  if (event == "session") {
    if (text("identity") == session.identity()) return;
    throw Error(ErrorParts{.where = name_,
                           .problem = "the journal of another session: its file, configuration or "
                                      "program differ from these",
                           .accepted = "the same session and program, or a new folder"});
  }
  const std::size_t which = session.find(text("spot"), name_);
  SpotHistory& spot = spots_[which];
  if (event == "skipped") {
    spot.skipped = true;
    spot.wanted = false;
  } else if (event == "repeat") {
    spot.wanted = true;
  } else if (event == "intent") {
    if (begun_ == 0.0) begun_ = json.value("unix_s", 0.0);
    spot.attempts.push_back(outcome_from_json(json, name_));
    attempts_.push_back(spot.attempts.back());
    spot.skipped = spot.wanted = false;
  } else if (event == "outcome" && !spot.attempts.empty()) {
    const AttemptOutcome outcome = outcome_from_json(json, name_);
    const auto same = [&](const AttemptOutcome& one) {
      return one.spot == outcome.spot && one.attempt == outcome.attempt;
    };
    spot.attempts.back() = outcome;
    *std::find_if(attempts_.begin(), attempts_.end(), same) = outcome;
  }
}

void SessionJournal::append(const std::string& line) {
  const std::string text = checksum(line) + " " + line + "\n";
  if (!file_.write(text.data(), text.size())) fail_by_errno(name_, "cannot be written");
  if (fsync(file_.number()) != 0) fail_by_errno(name_, "cannot be flushed to the disk");
}

double SessionJournal::elapsed() const {
  return begun_ > 0.0 ? std::max(0.0, system_seconds() - begun_) : 0.0;
}

double SessionJournal::energy() const noexcept {
  double energy = 0.0;
  for (const AttemptOutcome& attempt : attempts_) energy += attempt.energy_mJ * 1e-3;
  return energy;
}

void SessionJournal::intend(std::size_t spot, const AttemptOutcome& begun) {
  Json json = to_json(begun);
  const double now = system_seconds();
  json["unix_s"] = now;
  append(line_of(std::move(json), "intent"));
  if (begun_ == 0.0) begun_ = now;
  spots_[spot].attempts.push_back(begun);
  attempts_.push_back(begun);
  spots_[spot].skipped = spots_[spot].wanted = false;
}

void SessionJournal::finish(std::size_t spot, const AttemptOutcome& outcome) {
  append(line_of(to_json(outcome), "outcome"));
  spots_[spot].attempts.back() = attempts_.back() = outcome;
}

void SessionJournal::skip(std::size_t spot) {
  append(line_of({{"spot", names_[spot]}}, "skipped"));
  spots_[spot].skipped = true;
  spots_[spot].wanted = false;
}

void SessionJournal::repeat(std::size_t spot) {
  append(line_of({{"spot", names_[spot]}}, "repeat"));
  spots_[spot].wanted = true;
}

}  // namespace photocoag
