#include "photocoag/campaign/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <vector>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// FNV-1a: finds blocks that were cut short or mixed up, which is all that can happen to them.
std::uint64_t checksum(const double* block, std::size_t size) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (std::size_t i = 0; i < size; ++i) {
    hash ^= std::bit_cast<std::uint64_t>(block[i]);
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

// Up to `size` bytes from `offset` on; fewer at the end of the file.
std::size_t read_at(int file, const std::string& name, void* data, std::size_t size,
                    std::uint64_t offset) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = pread(file, static_cast<char*>(data) + done, size - done,
                              static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(name, "cannot be read");
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

constexpr std::size_t kChunk = 4096;  // blocks that are read at a time
constexpr auto kSyncEvery = std::chrono::seconds(1);

int sync_data(int file) noexcept {
  if (fdatasync(file) == 0) return 0;
  return errno == EINVAL ? 0 : errno;  // EINVAL: this kind of file cannot be brought anywhere
}

}  // namespace

Journal::Journal(const std::filesystem::path& file, const Campaign& campaign)
    : name_(file.string()),
      campaign_spots_(campaign.spots),
      block_size_(block_size(campaign.inputs.size()) + 1) {
  file_ = open(name_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) fail(name_, "cannot be opened");
  try {
    open_for(campaign);
  } catch (...) {
    close(file_);
    throw;
  }
}

void Journal::open_for(const Campaign& campaign) {
  if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    throw Error(ErrorParts{.where = name_,
                           .problem = "another process runs this campaign",
                           .accepted = "one at a time in a folder"});
  }
  const std::string header = header_of(campaign);
  header_ = header.size();
  std::string there(header.size(), '\0');
  if (read_at(file_, name_, there.data(), there.size(), 0) < header.size()) {
    // New, or cut short within the header.
    if (pwrite(file_, header.data(), header.size(), 0) != static_cast<ssize_t>(header.size())) {
      fail(name_, "cannot be written");
    }
  } else if (there != header) {
    throw Error(ErrorParts{.where = name_,
                           .problem = "the journal of another campaign: its file, configuration or "
                                      "program differ from these",
                           .accepted = "the same campaign and program, or a new folder"});
  }
  const auto end = static_cast<off_t>(for_each_good([this](const double* block) {
    const auto spot = std::bit_cast<std::uint64_t>(block[0]);
    if (spot < campaign_spots_) spots_.insert(spot);  // two wrote here once
  }));
  if (ftruncate(file_, end) != 0 || lseek(file_, end, SEEK_SET) < 0) {
    fail(name_, "cannot be written");
  }
  begin_sync();
}

Journal::~Journal() {
  if (syncing_.valid()) syncing_.wait();
  sync_data(file_);
  close(file_);
}

void Journal::begin_sync() {
  synced_ = std::chrono::steady_clock::now();
  syncing_ = std::async(std::launch::async, sync_data, file_);
}

bool Journal::sync_is_due() const {
  return std::chrono::steady_clock::now() - synced_ >= kSyncEvery &&
         (!syncing_.valid() ||
          syncing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready);
}

void Journal::end_sync() {
  if (!syncing_.valid()) return;
  errno = syncing_.get();
  if (errno != 0) fail(name_, "cannot be brought to the disk");
}

std::size_t Journal::bytes_per_spot(const Campaign& campaign) {
  return (block_size(campaign.inputs.size()) + 1) * sizeof(double);
}

void Journal::append(const SpotRecord& record) {
  std::vector<double> block = to_block(record);
  block.push_back(std::bit_cast<double>(checksum(block.data(), block.size())));
  const char* data = reinterpret_cast<const char*>(block.data());
  std::size_t left = block.size() * sizeof(double);
  while (left > 0) {
    const ssize_t written = write(file_, data, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(name_, "cannot be written");
    data += written;
    left -= static_cast<std::size_t>(written);
  }
  if (record.spot < campaign_spots_) spots_.insert(record.spot);
  const bool last = spots_.size() == campaign_spots_;
  if (last || sync_is_due()) {
    end_sync();
    begin_sync();
  }
  if (last) end_sync();
}

void Journal::for_each(const std::function<void(const double* block)>& see) const {
  SpotSet seen;
  for_each_good([&](const double* block) {
    const auto spot = std::bit_cast<std::uint64_t>(block[0]);
    if (spot < campaign_spots_ && seen.insert(spot)) see(block);
  });
}

std::uint64_t Journal::for_each_good(const std::function<void(const double* block)>& see) const {
  const std::size_t bytes = block_size_ * sizeof(double);
  std::vector<double> blocks(kChunk * block_size_);
  std::uint64_t at = header_;
  while (true) {
    const std::size_t whole = read_at(file_, name_, blocks.data(), kChunk * bytes, at) / bytes;
    for (std::size_t i = 0; i < whole; ++i) {
      const double* const block = blocks.data() + i * block_size_;
      const auto sum = std::bit_cast<std::uint64_t>(block[block_size_ - 1]);
      if (sum == checksum(block, block_size_ - 1)) see(block);
    }
    at += whole * bytes;
    if (whole < kChunk) return at;
  }
}

}  // namespace photocoag
