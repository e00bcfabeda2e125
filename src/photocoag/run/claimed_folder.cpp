#include "photocoag/run/claimed_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& folder, std::string problem, std::string accepted) {
  throw Error(ErrorParts{.where = "--out",
                         .problem = std::move(problem),
                         .found = folder.string(),
                         .accepted = std::move(accepted)});
}

[[noreturn]] void refuse_to_make(const fs::path& folder, const std::error_code& why) {
  refuse(folder, "the folder cannot be made: " + why.message(), "a folder that you may write to");
}

void make_parent(const fs::path& folder) {
  std::error_code error;
  if (!folder.parent_path().empty()) fs::create_directories(folder.parent_path(), error);
  if (error) refuse_to_make(folder, error);
}

// 0, or errno.
int make(const fs::path& folder) noexcept { return ::mkdir(folder.c_str(), 0777) == 0 ? 0 : errno; }

}  // namespace

void check_run_folder(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  if (fs::is_directory(folder, error) && fs::is_empty(folder, error) && !error) return;
  throw Error(ErrorParts{.where = "--out",
                         .problem = "a run never overwrites another one",
                         .found = folder.string() + ", which exists and is not an empty folder",
                         .accepted = "a new or empty folder"});
}

ClaimedFolder::ClaimedFolder(fs::path folder) : path_(std::move(folder)) {
  if (path_.has_relative_path() && path_.filename().empty()) path_ = path_.parent_path();
  make_parent(path_);
  const int made = make(path_);
  if (made != 0 && made != EEXIST) refuse_to_make(path_, {made, std::generic_category()});
  made_ = made == 0;
  check_run_folder(path_);
  lock_ = Descriptor(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock_.open()) refuse_to_make(path_, {errno, std::generic_category()});
  if (!lock_.lock()) refuse(path_, "another run has just begun there", "a new or empty folder");
  check_run_folder(path_);  // a previous holder of the lock may have written into it
}

ClaimedFolder ClaimedFolder::next_after(const fs::path& base) {
  make_parent(base);
  for (int number = 1;; ++number) {
    const fs::path folder =
        number == 1 ? base : fs::path(fmt::format("{}-{}", base.string(), number));
    const int made = make(folder);
    if (made == 0) {
      ClaimedFolder claimed(folder);
      claimed.made_ = true;
      return claimed;
    }
    if (made != EEXIST) refuse_to_make(folder, {made, std::generic_category()});
  }
}

ClaimedFolder::~ClaimedFolder() {
  if (made_) ::rmdir(path_.c_str());  // unless there is something in it
}

ClaimedFolder::ClaimedFolder(ClaimedFolder&& other) noexcept
    : path_(std::move(other.path_)),
      made_(std::exchange(other.made_, false)),
      lock_(std::move(other.lock_)) {}

}  // namespace photocoag
