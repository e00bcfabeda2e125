// Runs the built program as a user does and keeps what it said.
#pragma once

#include <filesystem>
#include <string>

namespace photocoag::testing {

struct ProgramResult {
  int exit_code = -1;  // 128 + signal if it was killed
  std::string out;
  std::string err;
};

/// A folder of its own that is removed at the end; the cache of the program under test lives in it.
class Sandbox {
 public:
  Sandbox();
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  /// `arguments` is shell text; the current folder is the sandbox. `before` is shell text put
  /// before the program.
  ProgramResult run(const std::string& arguments, const std::string& before = "") const;
  /// Number of files and folders below the sandbox, the cache left out.
  std::size_t entries() const;

 private:
  std::filesystem::path folder_;
};

std::string read_all(const std::filesystem::path& path);
void write_all(const std::filesystem::path& path, const std::string& text);

}  // namespace photocoag::testing
