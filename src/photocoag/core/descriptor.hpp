// Role: setup; an open file by its number, closed when it goes, and whole reads and writes. Used by
// core, run, campaign, session, rt. Real time: no.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace photocoag {

/// Writes all bytes to an open file. False: errno says why, ENOSPC where nothing more went in.
bool write_all(int file, const void* data, std::size_t bytes) noexcept;

class Descriptor {
 public:
  Descriptor() = default;
  /// Below 0: none; errno says why.
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() { close(); }

  int number() const noexcept { return number_; }
  bool open() const noexcept { return number_ >= 0; }
  /// False: the system could not; errno says why.
  bool close() noexcept;

  /// write_all(), here and at `offset`.
  bool write(const void* data, std::size_t bytes) const noexcept {
    return write_all(number_, data, bytes);
  }
  bool write_at(const void* data, std::size_t bytes, std::uint64_t offset) const noexcept;
  /// Bytes read, fewer only at the end of the file; below 0: errno says why.
  std::int64_t read_at(void* data, std::size_t bytes, std::uint64_t offset) const noexcept;
  /// All of them. False: errno says why, EIO at the end of the file.
  bool read_all_at(void* data, std::size_t bytes, std::uint64_t offset) const noexcept;

  /// No other process gets this lock until the file is closed. False: another one has it.
  bool lock() const noexcept;

 private:
  int number_ = -1;
};

/// Throws Error: "where: what: what errno means".
[[noreturn]] void fail_by_errno(const std::string& where, const std::string& what);

}  // namespace photocoag
