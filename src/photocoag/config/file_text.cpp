#include "photocoag/config/file_text.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <system_error>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMostBytes = 1'000'000;

[[noreturn]] void refuse(const std::string& file, std::string problem) {
  throw Error({.where = file,
               .problem = std::move(problem),
               .accepted = "a regular TOML file of at most 1 MB"});
}

[[noreturn]] void refuse_errno(const std::string& file) {
  refuse(file, "cannot be read: " + std::generic_category().message(errno));
}

class Descriptor {
 public:
  // Without waiting: opening a pipe that nobody writes to would otherwise hang.
  explicit Descriptor(const std::string& file)
      : number_(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)) {
    if (number_ < 0) refuse_errno(file);
  }
  ~Descriptor() { ::close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const noexcept { return number_; }

 private:
  int number_;
};

}  // namespace

std::string read_configuration_file(const std::string& file) {
  if (file.find('\0') != std::string::npos) refuse(file.c_str(), "a zero byte in the name");
  const Descriptor descriptor(file);
  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) refuse_errno(file);
  if (S_ISDIR(status.st_mode)) refuse(file, "a directory");
  if (!S_ISREG(status.st_mode)) refuse(file, "not a regular file");
  std::string content(kMostBytes + 1, '\0');
  std::size_t size = 0;
  while (size < content.size()) {
    const ::ssize_t count =
        ::read(descriptor.number(), content.data() + size, content.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse_errno(file);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  if (size > kMostBytes) refuse(file, "larger than 1 MB");
  content.resize(size);
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);
  return content;
}

}  // namespace photocoag
