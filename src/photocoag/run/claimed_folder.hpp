// Role: the program; output folders, one owner each. Used by run, study, campaign, apps.
#pragma once

#include <filesystem>

#include "photocoag/core/descriptor.hpp"

namespace photocoag {

/// Throws Error if `folder` exists and is not an empty folder. Creates nothing.
void check_run_folder(const std::filesystem::path& folder);

/// A folder that was new or empty and now is this object's: of several processes that ask for the
/// same one at once, one gets it. The claim ends with the object. A folder that it has made and
/// that is still empty goes with it; files keep others away for good.
class ClaimedFolder {
 public:
  /// Makes the folder, and those above it, if need be. Throws Error naming --out.
  explicit ClaimedFolder(std::filesystem::path folder);
  /// Makes the first of base, base-2, base-3, … that does not exist. Throws Error naming --out.
  static ClaimedFolder next_after(const std::filesystem::path& base);
  ~ClaimedFolder();
  ClaimedFolder(ClaimedFolder&& other) noexcept;
  ClaimedFolder& operator=(ClaimedFolder&&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  bool made_ = false;
  Descriptor lock_;
};

}  // namespace photocoag
