#include "photocoag/core/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "photocoag/core/descriptor.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

std::string errno_text() { return std::generic_category().message(errno); }

[[noreturn]] void fail_to_write(const std::string& path, std::string_view why) {
  throw Error(ErrorParts{.where = path, .problem = fmt::format("cannot be written: {}", why)});
}

// Everything from the current position on; empty where that fails.
std::optional<std::string> read_all(int file, std::size_t most) {
  std::string content;
  std::size_t size = 0;
  while (size <= most) {
    content.resize(size + 65536);
    const ::ssize_t count = ::read(file, content.data() + size, content.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return std::nullopt;
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  content.resize(size);
  return content;
}

// The open file of this process that /dev/fd/N or /proc/self/fd/N stands for.
std::optional<int> own_descriptor(const fs::path& path) {
  std::error_code error;
  const fs::path own = fs::canonical("/proc/self/fd", error);
  if (error || fs::canonical(path.parent_path(), error) != own || error) return std::nullopt;
  const std::string name = path.filename().string();
  int number = -1;
  const auto [end, problem] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (problem != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return number;
}

// `path` with all symbolic links resolved; the target need not exist.
fs::path target_of(const std::string& path) {
  constexpr int kMostLinks = 40;  // as the kernel
  fs::path target = path;
  for (int links = 0; links <= kMostLinks; ++links) {
    std::error_code error;
    if (own_descriptor(target) || !fs::is_symlink(fs::symlink_status(target, error))) return target;
    const fs::path next = fs::read_symlink(target, error);
    if (error) fail_to_write(path, error.message());
    target = target.parent_path() / next;
  }
  fail_to_write(path, std::make_error_code(std::errc::too_many_symbolic_link_levels).message());
}

void write_into(int file, const std::string& path, std::string_view content) {
  std::fflush(nullptr);  // keep the order of what was printed
  if (!write_all(file, content.data(), content.size())) fail_to_write(path, errno_text());
}

// A new file in `folder`, open for writing, and its name.
std::pair<int, std::string> new_file_in(const fs::path& folder) {
  static std::atomic<unsigned> next{0};
  constexpr int kMostTries = 1000;
  std::string name;
  int file = -1;
  for (int i = 0; i < kMostTries; ++i) {
    name = (folder / fmt::format(".photocoag-{}-{}.part", ::getpid(), next++)).string();
    file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file >= 0 || errno != EEXIST) break;
  }
  return {file, name};
}

// Only root can change the owner, and only then would a rewrite change it.
void keep_owner(int file, const struct stat& old) noexcept {
  if (::fchown(file, old.st_uid, old.st_gid) != 0) errno = 0;
  ::fchmod(file, old.st_mode & 07777U);
}

}  // namespace

std::string read_file(const std::string& file, std::size_t max_bytes, std::string_view kind) {
  const auto refuse = [&](std::string problem) {
    throw Error(ErrorParts{.where = std::string(file.c_str()),  // up to a zero byte
                           .problem = std::move(problem),
                           .accepted = fmt::format("a regular {} of at most {} MB", kind,
                                                   static_cast<double>(max_bytes) * 1e-6)});
  };
  const auto refuse_errno = [&] { refuse("cannot be read: " + errno_text()); };
  if (file.find('\0') != std::string::npos) refuse("a zero byte in the name");
  // Non-blocking: opening a pipe without a writer would otherwise hang.
  const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (descriptor.number() < 0) refuse_errno();
  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) refuse_errno();
  if (S_ISDIR(status.st_mode)) refuse("a directory");
  if (!S_ISREG(status.st_mode)) refuse("not a regular file");
  std::optional<std::string> content = read_all(descriptor.number(), max_bytes);
  if (!content) refuse_errno();
  if (content->size() > max_bytes)
    refuse(fmt::format("larger than {} MB", static_cast<double>(max_bytes) * 1e-6));
  return *std::move(content);
}

std::string plain_text(std::string content, const std::string& where) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (content.starts_with(kMark)) content.erase(0, kMark.size());
  if (content.starts_with(kMark)) {
    throw Error(ErrorParts{.where = where + ":1",
                           .problem = "two byte order marks",
                           .accepted = "text in UTF-8, with one mark at most"});
  }
  const std::size_t zero = content.find('\0');
  if (zero == std::string::npos) return content;
  const auto line =
      1 + std::count(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(zero), '\n');
  throw Error(ErrorParts{.where = fmt::format("{}:{}", where, line),
                         .problem = "a zero byte",
                         .accepted = "text in UTF-8"});
}

void write_file(const std::string& path, std::string_view content) {
  const fs::path target = target_of(path);
  if (const std::optional<int> own = own_descriptor(target)) {
    return write_into(*own, path, content);
  }
  struct stat old {};
  const bool exists = ::stat(target.c_str(), &old) == 0;
  if (exists && (S_ISFIFO(old.st_mode) || S_ISCHR(old.st_mode))) {
    const Descriptor device(::open(target.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC));
    return write_into(device.number(), path, content);
  }
  if (exists && S_ISDIR(old.st_mode)) fail_to_write(path, "a directory");
  if (exists && !S_ISREG(old.st_mode)) fail_to_write(path, "not a regular file");
  const auto [number, temporary] = new_file_in(target.parent_path());
  Descriptor file(number);
  bool good = number >= 0;
  if (good && exists) keep_owner(number, old);
  good = good && file.write(content.data(), content.size()) && file.close() &&
         ::rename(temporary.c_str(), target.c_str()) == 0;
  if (good) return;
  const std::string why = errno_text();
  if (number >= 0) ::unlink(temporary.c_str());
  fail_to_write(path, why);
}

std::string written_by(const std::function<void(const std::string& name)>& write) {
  const Descriptor memory(::memfd_create("photocoag", MFD_CLOEXEC));
  const auto check = [](bool good) {
    if (!good) throw Error(ErrorParts{.where = "a file in memory", .problem = errno_text()});
  };
  check(memory.number() >= 0);
  write(fmt::format("/proc/self/fd/{}", memory.number()));
  check(::lseek(memory.number(), 0, SEEK_SET) == 0);
  std::optional<std::string> content = read_all(memory.number(), std::string().max_size() / 2);
  check(content.has_value());
  return *std::move(content);
}

}  // namespace photocoag
