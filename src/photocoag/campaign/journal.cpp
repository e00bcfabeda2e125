#include "photocoag/campaign/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// FNV-1a: finds blocks that were cut short or mixed up, which is all that can happen to them.
std::uint64_t checksum(const std::vector<double>& block) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const double value : block) {
    hash ^= std::bit_cast<std::uint64_t>(value);
    hash *= 1099511628211ULL;
  }
  return hash;
}

[[noreturn]] void fail(const std::string& name, const std::string& what) {
  throw Error(ErrorParts{.where = name, .problem = what + ": " + std::strerror(errno)});
}

std::string header_of(const Campaign& campaign) {
  return fmt::format("photocoag campaign journal 1 {}\n", campaign.identity());
}

}  // namespace

std::size_t block_size(std::size_t inputs) { return 2 + inputs + outcome_columns().size(); }

std::vector<double> to_block(const SpotRecord& record) {
  std::vector<double> block = {std::bit_cast<double>(record.spot),
                               std::bit_cast<double>(record.noise_seed)};
  block.insert(block.end(), record.inputs.begin(), record.inputs.end());
  block.insert(block.end(), record.outcomes.begin(), record.outcomes.end());
  return block;
}

SpotRecord from_block(const double* block, std::size_t inputs) {
  const double* values = block + 2;
  return {.spot = std::bit_cast<std::uint64_t>(block[0]),
          .noise_seed = std::bit_cast<std::uint64_t>(block[1]),
          .inputs = {values, values + inputs},
          .outcomes = {values + inputs, block + block_size(inputs)}};
}

Journal::Journal(const std::filesystem::path& file, const Campaign& campaign)
    : name_(file.string()) {
  file_ = open(name_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) fail(name_, "cannot be opened");
  try {
    read(campaign);
  } catch (...) {
    close(file_);
    throw;
  }
}

void Journal::read(const Campaign& campaign) {
  if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    throw Error(ErrorParts{.where = name_,
                           .problem = "another process runs this campaign",
                           .accepted = "one at a time in a folder"});
  }
  const std::string header = header_of(campaign);
  struct stat status {};
  if (fstat(file_, &status) != 0) fail(name_, "cannot be read");
  std::string content(static_cast<std::size_t>(status.st_size), '\0');
  if (pread(file_, content.data(), content.size(), 0) != status.st_size) {
    fail(name_, "cannot be read");
  }
  std::size_t good = 0;
  if (content.size() < header.size()) {
    // New, or cut short within the header.
    if (pwrite(file_, header.data(), header.size(), 0) != static_cast<ssize_t>(header.size())) {
      fail(name_, "cannot be written");
    }
    good = header.size();
  } else if (std::string_view(content).substr(0, header.size()) != header) {
    throw Error(ErrorParts{.where = name_,
                           .problem = "the journal of another campaign: its file, configuration or "
                                      "program differ from these",
                           .accepted = "the same campaign and program, or a new folder"});
  } else {
    const std::size_t inputs = campaign.inputs.size();
    const std::size_t bytes = (block_size(inputs) + 1) * sizeof(double);
    good = header.size();
    std::vector<double> block(block_size(inputs));
    std::vector<bool> seen(campaign.spots, false);
    for (; good + bytes <= content.size(); good += bytes) {
      std::uint64_t sum = 0;
      std::memcpy(block.data(), content.data() + good, bytes - sizeof sum);
      std::memcpy(&sum, content.data() + good + bytes - sizeof sum, sizeof sum);
      if (sum != checksum(block)) break;
      SpotRecord record = from_block(block.data(), inputs);
      if (record.spot >= campaign.spots || seen[record.spot]) continue;  // two wrote here once
      seen[record.spot] = true;
      found_.push_back(std::move(record));
    }
  }
  if (ftruncate(file_, static_cast<off_t>(good)) != 0 ||
      lseek(file_, static_cast<off_t>(good), SEEK_SET) < 0) {
    fail(name_, "cannot be written");
  }
}

Journal::~Journal() {
  if (file_ >= 0) close(file_);
}

void Journal::append(const SpotRecord& record) {
  std::vector<double> block = to_block(record);
  block.push_back(std::bit_cast<double>(checksum(block)));
  const char* data = reinterpret_cast<const char*>(block.data());
  std::size_t left = block.size() * sizeof(double);
  while (left > 0) {
    const ssize_t written = write(file_, data, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(name_, "cannot be written");
    data += written;
    left -= static_cast<std::size_t>(written);
  }
}

}  // namespace photocoag
