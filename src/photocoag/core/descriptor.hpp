// Role: setup; an owned file descriptor with complete reads and writes. Used by core, run,
// campaign, session, rt. Real time: no.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace photocoag {

/// Writes all bytes to an open file. False: see errno; ENOSPC if a write made no progress.
bool write_all(int file, const void* data, std::size_t bytes) noexcept;

class Descriptor {
 public:
  Descriptor() = default;
  /// Owns `number`; below 0: none.
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() { close(); }

  int number() const noexcept { return number_; }
  bool open() const noexcept { return number_ >= 0; }
  /// False: see errno.
  bool close() noexcept;

  /// write_all() at the current position, or at `offset`.
  bool write(const void* data, std::size_t bytes) const noexcept {
    return write_all(number_, data, bytes);
  }
  bool write_at(const void* data, std::size_t bytes, std::uint64_t offset) const noexcept;
  /// Bytes read, fewer than `bytes` only at the end of the file; below 0: see errno.
  std::int64_t read_at(void* data, std::size_t bytes, std::uint64_t offset) const noexcept;
  /// Reads all bytes. False: see errno; EIO at the end of the file.
  bool read_all_at(void* data, std::size_t bytes, std::uint64_t offset) const noexcept;

  /// Locks the file until it is closed. False: another process holds the lock. True also on a file
  /// system without locks.
  bool lock() const noexcept;

 private:
  int number_ = -1;
};

/// Throws Error "where: what: text of errno".
[[noreturn]] void fail_by_errno(const std::string& where, const std::string& what);

}  // namespace photocoag
