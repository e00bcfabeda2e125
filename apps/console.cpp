#include "console.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <system_error>

#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

std::atomic<int> first_failure{0};  // errno

void failed() noexcept {
  int none = 0;
  first_failure.compare_exchange_strong(none, errno != 0 ? errno : EIO);
}

// write() fails with EPIPE or EFBIG instead. Not SIG_IGN: children would inherit that.
void turn_into_error(int signal) noexcept {
  struct sigaction action {};
  if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler != SIG_DFL) return;
  action.sa_handler = [](int) {};
  action.sa_flags = SA_RESTART;
  sigaction(signal, &action, nullptr);
}

// Text from files or callers must not control the terminal: control characters except line ends and
// tabs become \x and two digits.
std::string without_controls(const std::string& text) {
  std::string shown;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F: controls of eight bits.
    const bool eight_bits =
        byte == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if ((byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7F || eight_bits) {
      shown += fmt::format("\\x{:02x}", byte);
    } else {
      shown += text[i];
    }
  }
  return shown;
}

}  // namespace

void prepare_console() noexcept {
  // Otherwise the next opened file would become standard output. A closed standard output stays
  // unwritable.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    if (open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY) != stream) return;
  }
  for (const int signal : {SIGPIPE, SIGXFSZ}) turn_into_error(signal);
}

bool everything_printed() noexcept {
  errno = 0;
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) failed();
  const int why = first_failure.load();
  if (why == 0) return true;
  // No message for a closed pipe, as with `head`.
  if (why != EPIPE) {
    say("photocoag: not all output could be written: {}\n", std::generic_category().message(why));
  }
  return false;
}

void print_text(std::FILE* stream, fmt::string_view format, fmt::format_args values) noexcept {
  try {
    std::string text = fmt::vformat(format, values);
    if (stream == stderr) text = without_controls(text);
    errno = 0;
    if (std::fwrite(text.data(), 1, text.size(), stream) != text.size()) failed();
  } catch (...) {
    failed();
  }
}

void write_output(const std::string& path, const std::string& text) {
  if (path == "-") return print("{}", text);
  if (!path.empty()) write_file(path, text);
}

}  // namespace photocoag
