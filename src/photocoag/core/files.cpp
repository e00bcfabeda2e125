#include "photocoag/core/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// Open for reading without waiting: opening a pipe that nobody writes to would otherwise hang.
class Descriptor {
 public:
  explicit Descriptor(const std::string& file)
      : number_(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const noexcept { return number_; }

 private:
  int number_;
};

[[noreturn]] void fail_to_write(const std::string& path, const std::string& temporary,
                                std::string_view why) {
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  throw Error(ErrorParts{.where = path, .problem = fmt::format("cannot be written: {}", why)});
}

}  // namespace

std::string read_file(const std::string& file, std::size_t max_bytes, std::string_view kind) {
  const auto refuse = [&](std::string problem) {
    throw Error(ErrorParts{.where = std::string(file.c_str()),  // up to a zero byte
                           .problem = std::move(problem),
                           .accepted = fmt::format("a regular {} of at most {} MB", kind,
                                                   static_cast<double>(max_bytes) * 1e-6)});
  };
  const auto refuse_errno = [&] {
    refuse("cannot be read: " + std::generic_category().message(errno));
  };
  if (file.find('\0') != std::string::npos) refuse("a zero byte in the name");
  const Descriptor descriptor(file);
  if (descriptor.number() < 0) refuse_errno();
  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) refuse_errno();
  if (S_ISDIR(status.st_mode)) refuse("a directory");
  if (!S_ISREG(status.st_mode)) refuse("not a regular file");
  std::string content;
  std::size_t size = 0;
  while (size <= max_bytes) {
    content.resize(size + 65536);
    const ::ssize_t count =
        ::read(descriptor.number(), content.data() + size, content.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse_errno();
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  if (size > max_bytes)
    refuse(fmt::format("larger than {} MB", static_cast<double>(max_bytes) * 1e-6));
  content.resize(size);
  return content;
}

void write_file(const std::string& path, std::string_view content) {
  const std::string temporary = fmt::format("{}.part{}", path, getpid());
  {
    std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
    stream.write(content.data(), static_cast<std::streamsize>(content.size()));
    stream.flush();
    if (!stream) fail_to_write(path, temporary, "does the folder exist, and is there room?");
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) fail_to_write(path, temporary, error.message());
}

}  // namespace photocoag
