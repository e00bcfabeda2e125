#include "photocoag/core/descriptor.hpp"

#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// Repeats `call`(done, bytes left) until nothing is left or it fails; returns the bytes done.
template <typename Call>
std::size_t repeat(std::size_t bytes, Call call) noexcept {
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t now = call(done, bytes - done);
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) {
      if (now == 0) errno = 0;
      break;
    }
    done += static_cast<std::size_t>(now);
  }
  return done;
}

bool is_whole(std::size_t done, std::size_t bytes) noexcept {
  if (done < bytes && errno == 0) errno = ENOSPC;
  return done == bytes;
}

}  // namespace

bool Descriptor::close() noexcept {
  return number_ < 0 || ::close(std::exchange(number_, -1)) == 0;
}

bool write_all(int file, const void* data, std::size_t bytes) noexcept {
  const auto write_on = [&](std::size_t done, std::size_t left) {
    return ::write(file, static_cast<const char*>(data) + done, left);
  };
  return is_whole(repeat(bytes, write_on), bytes);
}

bool Descriptor::write_at(const void* data, std::size_t bytes,
                          std::uint64_t offset) const noexcept {
  const auto write_on = [&](std::size_t done, std::size_t left) {
    return ::pwrite(number_, static_cast<const char*>(data) + done, left,
                    static_cast<off_t>(offset + done));
  };
  return is_whole(repeat(bytes, write_on), bytes);
}

std::int64_t Descriptor::read_at(void* data, std::size_t bytes,
                                 std::uint64_t offset) const noexcept {
  const auto read_on = [&](std::size_t done, std::size_t left) {
    return ::pread(number_, static_cast<char*>(data) + done, left,
                   static_cast<off_t>(offset + done));
  };
  const std::size_t done = repeat(bytes, read_on);
  return done < bytes && errno != 0 ? -1 : static_cast<std::int64_t>(done);
}

bool Descriptor::read_all_at(void* data, std::size_t bytes, std::uint64_t offset) const noexcept {
  const std::int64_t got = read_at(data, bytes, offset);
  if (got >= 0) errno = EIO;
  return got == static_cast<std::int64_t>(bytes);
}

bool Descriptor::lock() const noexcept {
  return ::flock(number_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

void fail_by_errno(const std::string& where, const std::string& what) {
  throw Error(
      ErrorParts{.where = where, .problem = what + ": " + std::generic_category().message(errno)});
}

}  // namespace photocoag
