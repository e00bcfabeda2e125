#include "photocoag/log/writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {

LogWriter::LogWriter(std::filesystem::path folder, LogHeader header, LogOptions options)
    : folder_(std::move(folder)),
      header_(std::move(header)),
      options_(std::move(options)),
      ring_(options_.ring_records),
      batch_(kBlockRecords),
      block_(sizeof(BlockHeader) + kBlockRecords * log_record_bytes()) {
  if (!options_.write) options_.write = ::write;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error || !open_segment(0)) {
    throw Error(ErrorParts{
        .where = folder_.string(),
        .problem = "the log cannot be started: " +
                   (error ? error : std::error_code(errno, std::generic_category())).message(),
        .accepted = "a folder that you may write to, on a disk with room"});
  }
  try {
    thread_ = std::thread([this] { run(); });
    sync_thread_ = std::thread([this] { run_sync(); });
  } catch (...) {
    closing_.store(true, std::memory_order_release);
    if (thread_.joinable()) thread_.join();
    ::close(file_);
    throw;
  }
}

LogWriter::~LogWriter() {
  if (thread_.joinable()) close();
}

void LogWriter::record(LogRecord& record) noexcept {
  const std::uint64_t number = produced_.load(std::memory_order_relaxed);
  record.record = static_cast<std::int64_t>(number);
  if (!ring_.push(record)) {
    overflow_.store(overflow_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    failed_.store(true, std::memory_order_relaxed);
  }
  produced_.store(number + 1, std::memory_order_release);
}

LogTotals LogWriter::close() {
  closing_.store(true, std::memory_order_release);
  thread_.join();
  all_written_.store(true, std::memory_order_release);
  sync_thread_.join();
  if (file_ >= 0) ::close(file_);
  file_ = -1;
  LogTotals totals{
      .produced = produced_.load(), .written = written_, .dropped = overflow_.load() + lost_};
  if (error_ != 0) {
    trouble_ = fmt::format("{} records could not be written: {}", lost_,
                           std::generic_category().message(error_));
  }
  if (overflow_.load() > 0) {
    trouble_ += fmt::format("{}{} records dropped: the disk was too slow",
                            trouble_.empty() ? "" : "; ", overflow_.load());
  }
  return totals;
}

void LogWriter::run() noexcept {
  // On a busy machine an ordinary thread may wait for hundreds of milliseconds. Far below the
  // loop's priority.
  constexpr int kPriority = 5;
  request_fifo_priority(kPriority);  // without it the log falls behind under load
  for (bool last = false; !last;) {
    last = closing_.load(std::memory_order_acquire);
    while (drain() > 0) {
    }
    if (last) {
      write_block(0, BlockHeader::kLast);
    } else {
      wait_until(monotonic_ns() + options_.look_ns);
    }
  }
}

void LogWriter::run_sync() noexcept {
  std::int64_t next = monotonic_ns();
  for (bool last = false; !last;) {
    last = all_written_.load(std::memory_order_acquire);
    if (const std::int64_t now = monotonic_ns(); last || now >= next) {
      const int retired = retired_.exchange(-1);
      const int current = to_sync_.load();
      for (const int file : {retired, current}) {
        if (file >= 0) ::fdatasync(file);
      }
      if (retired >= 0) ::close(retired);
      next = now + options_.sync_ns;
    }
    if (!last) wait_until(monotonic_ns() + options_.look_ns);
  }
}

std::size_t LogWriter::drain() noexcept {
  const std::size_t count = ring_.pop(batch_);
  if (count > 0) write_block(count, 0);
  return count;
}

void LogWriter::write_block(std::size_t records, std::uint32_t flags) noexcept {
  BlockHeader header;
  header.flags = flags;
  header.records = static_cast<std::uint32_t>(records);
  const std::uint64_t dropped = overflow_.load(std::memory_order_relaxed) + lost_;
  header.totals = {
      .produced = written_ + records + dropped, .written = written_ + records, .dropped = dropped};
  const std::size_t size = sizeof(header) + records * log_record_bytes();
  std::memcpy(block_.data(), &header, sizeof(header));
  for (std::size_t k = 0; k < records; ++k) {
    pack(batch_[k], block_.data() + sizeof(header) + k * log_record_bytes());
  }
  seal_block(std::span(block_).first(size));
  const bool full = segment_size_ + size > options_.segment_bytes && records > 0;
  const bool last = (flags & BlockHeader::kLast) != 0;
  if ((!full || open_segment(header_.segment + 1)) && (last || reserve(size)) &&
      write_all(block_.data(), size)) {
    segment_size_ += size;
    written_ += records;
    return;
  }
  if (error_ == 0) error_ = errno;
  failed_.store(true, std::memory_order_relaxed);
  lost_ += records;
  // Remove a partial block.
  struct stat now {};
  if (::fstat(file_, &now) == 0 && now.st_size > static_cast<off_t>(segment_size_) &&
      ::ftruncate(file_, static_cast<off_t>(segment_size_)) == 0) {
    ::lseek(file_, 0, SEEK_END);
  }
}

// The last block holds the record counts; its space is reserved early, so that a full disk cannot
// hide how many records were lost.
bool LogWriter::reserve(std::size_t bytes) noexcept {
  const auto end = static_cast<off_t>(segment_size_);
  const auto size = static_cast<off_t>(bytes + sizeof(BlockHeader));
  rlimit limit{};  // of the file's size, which space beyond its end is not checked against
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && static_cast<rlim_t>(end + size) > limit.rlim_cur) {
    errno = EFBIG;
    return false;
  }
  while (::fallocate(file_, FALLOC_FL_KEEP_SIZE, end, size) != 0) {
    if (errno == EINTR) continue;
    // Unsupported by some file systems: continue without.
    return errno != ENOSPC && errno != EDQUOT;
  }
  return true;
}

bool LogWriter::write_all(const std::byte* bytes, std::size_t count) noexcept {
  while (count > 0) {
    const ssize_t done = options_.write(file_, bytes, count);
    if (done < 0 && errno == EINTR) continue;
    if (done == 0) errno = ENOSPC;
    if (done <= 0) return false;
    bytes += done;
    count -= static_cast<std::size_t>(done);
  }
  return true;
}

/// The old segment is released only once the new one exists: until then it can take the last block.
bool LogWriter::open_segment(std::int64_t number) noexcept {
  const int before = file_;
  const std::size_t size_before = segment_size_;
  const std::int64_t number_before = header_.segment;
  std::string name;
  try {
    name = (folder_ / fmt::format("{:06}.seg", number)).string();
    header_.segment = number;
    const std::string header = segment_header(header_);
    file_ = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_APPEND, 0644);
    segment_size_ = 0;
    if (file_ >= 0 && reserve(header.size()) &&
        write_all(reinterpret_cast<const std::byte*>(header.data()), header.size())) {
      segment_size_ = header.size();
      to_sync_.store(file_);
      const int unsynced = retired_.exchange(before);
      if (unsynced >= 0) ::close(unsynced);  // two segments per poll: the disk is far behind
      return true;
    }
  } catch (const std::exception&) {
    errno = ENOMEM;
  }
  const int why = errno;
  if (file_ != before && file_ >= 0) {
    ::close(file_);
    ::unlink(name.c_str());
  }
  file_ = before;
  segment_size_ = size_before;
  header_.segment = number_before;
  errno = why;
  return false;
}

bool disk_has_room(const std::filesystem::path& folder, std::uint64_t bytes) noexcept {
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) != 0) return false;
  return static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize >= bytes;
}

}  // namespace photocoag
