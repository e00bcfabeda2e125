#include "support/small_disk.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace photocoag::testing {
namespace {

bool write_text(const char* file, const std::string& text) {
  const int descriptor = ::open(file, O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool done =
      ::write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  ::close(descriptor);
  return done;
}

/// What failed, in words; empty if the small disk is there.
std::string mount_small_disk(const std::filesystem::path& folder, std::size_t bytes) {
  const auto failed = [](const char* what) {
    return std::string(what) + ": " + std::strerror(errno);
  };
  const std::string user = "0 " + std::to_string(getuid()) + " 1";
  const std::string group = "0 " + std::to_string(getgid()) + " 1";
  if (unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return failed("unshare");
  if (!write_text("/proc/self/setgroups", "deny") || !write_text("/proc/self/uid_map", user) ||
      !write_text("/proc/self/gid_map", group)) {
    return failed("uid_map");
  }
  if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return failed("mount /");
  const std::string size = "size=" + std::to_string(bytes);
  if (mount("tmpfs", folder.c_str(), "tmpfs", MS_NOSUID | MS_NODEV, size.c_str()) != 0) {
    return failed("mount tmpfs");
  }
  return {};
}

constexpr int kUnsupported = 77;

[[noreturn]] void run_child(const std::filesystem::path& folder, std::size_t bytes,
                            const std::function<void()>& body, int report) {
  const std::string unsupported = mount_small_disk(folder, bytes);
  if (!unsupported.empty()) {
    const ssize_t said = ::write(report, unsupported.data(), unsupported.size());
    _exit(said > 0 ? kUnsupported : 1);
  }
  bool passed = false;
  try {
    body();
    passed = !::testing::Test::HasFailure();
  } catch (const std::exception& error) {
    std::printf("thrown: %s\n", error.what());
  }
  std::fflush(stdout);
  _exit(passed ? 0 : 1);
}

}  // namespace

SmallDiskOutcome on_small_disk(const std::filesystem::path& folder, std::size_t bytes,
                               const std::function<void()>& body) {
  std::array<int, 2> pipe_ends{};
  if (pipe2(pipe_ends.data(), O_CLOEXEC) != 0) return {.unsupported = "no pipe"};
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) run_child(folder, bytes, body, pipe_ends[1]);
  ::close(pipe_ends[1]);
  SmallDiskOutcome outcome;
  std::array<char, 256> text{};
  const ssize_t said = ::read(pipe_ends[0], text.data(), text.size());
  ::close(pipe_ends[0]);
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) return {.unsupported = "no process"};
  if (WIFEXITED(status) && WEXITSTATUS(status) == kUnsupported && said > 0) {
    outcome.unsupported.assign(text.data(), static_cast<std::size_t>(said));
  }
  outcome.passed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return outcome;
}

bool Ballast::fill() const {
  const int descriptor = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0) return errno == ENOSPC;
  const std::array<char, 4096> page{};
  while (::write(descriptor, page.data(), page.size()) > 0) {
  }
  const bool full = errno == ENOSPC;
  ::close(descriptor);
  return full;
}

}  // namespace photocoag::testing
