// Role: tests; a disk that is really full: a small file system of its own (tmpfs) in a child
// process with mount and user namespaces, so that ENOSPC comes from the kernel. No privileges are
// needed where the kernel lets users have namespaces; elsewhere the test says that it was skipped.
// Linux.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace photocoag::testing {

struct SmallDiskOutcome {
  std::string unsupported;  ///< why there is no small disk here; empty: there was one
  bool passed = false;      ///< `body` ran to its end without a failed assertion
};

/// A TEST skips with `unsupported`, if that is not empty, and expects `passed`.
/// Runs `body` in a child process that sees a file system of `bytes` (whole pages) at `folder`,
/// which must exist. Assertions in `body` count in the child and are printed; the folder is as
/// before at the end. From a process without other threads.
SmallDiskOutcome on_small_disk(const std::filesystem::path& folder, std::size_t bytes,
                               const std::function<void()>& body);

/// A file that takes all the room that is left on its disk.
class Ballast {
 public:
  explicit Ballast(std::filesystem::path file) : file_(std::move(file)) {}
  /// Until the kernel says ENOSPC. False if something else was the matter.
  bool fill() const;
  void release() const { std::filesystem::remove(file_); }

 private:
  std::filesystem::path file_;
};

}  // namespace photocoag::testing
