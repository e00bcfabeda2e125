#include "photocoag/campaign/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
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

std::string header_of(const Campaign& campaign) {
  return fmt::format("photocoag campaign journal 1 {}\n", campaign.identity());
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
      block_size_(block_size(campaign.inputs.size()) + 1),
      file_(open(name_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (!file_.open()) fail("cannot be opened");
  open_for(campaign);
}

void Journal::fail(const char* what) const { fail_by_errno(name_, what); }

std::size_t Journal::read_at(void* data, std::size_t bytes, std::uint64_t offset) const {
  const std::int64_t got = file_.read_at(data, bytes, offset);
  if (got < 0) fail("cannot be read");
  return static_cast<std::size_t>(got);
}

void Journal::open_for(const Campaign& campaign) {
  if (!file_.lock()) {
    throw Error(ErrorParts{.where = name_,
                           .problem = "another process runs this campaign",
                           .accepted = "one at a time in a folder"});
  }
  const std::string header = header_of(campaign);
  header_ = header.size();
  std::string there(header.size(), '\0');
  if (read_at(there.data(), there.size(), 0) < header.size()) {
    // New, or cut short within the header.
    if (!file_.write_at(header.data(), header.size(), 0)) fail("cannot be written");
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
  const int file = file_.number();
  if (ftruncate(file, end) != 0 || lseek(file, end, SEEK_SET) < 0) fail("cannot be written");
  begin_sync();
}

Journal::~Journal() {
  if (syncing_.valid()) syncing_.wait();
  sync_data(file_.number());
}

void Journal::begin_sync() {
  synced_ = std::chrono::steady_clock::now();
  syncing_ = std::async(std::launch::async, sync_data, file_.number());
}

bool Journal::sync_is_due() const {
  return std::chrono::steady_clock::now() - synced_ >= kSyncEvery &&
         (!syncing_.valid() ||
          syncing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready);
}

void Journal::end_sync() {
  if (!syncing_.valid()) return;
  errno = syncing_.get();
  if (errno != 0) fail("cannot be flushed to the disk");
}

std::size_t Journal::bytes_per_spot(const Campaign& campaign) {
  return (block_size(campaign.inputs.size()) + 1) * sizeof(double);
}

void Journal::append(const SpotRecord& record) {
  std::vector<double> block = to_block(record);
  block.push_back(std::bit_cast<double>(checksum(block.data(), block.size())));
  if (!file_.write(block.data(), block.size() * sizeof(double))) fail("cannot be written");
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
    const std::size_t whole = read_at(blocks.data(), kChunk * bytes, at) / bytes;
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
