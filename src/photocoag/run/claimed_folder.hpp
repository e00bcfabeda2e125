// Role: the program; output folders, one owner each. Used by run, study, campaign, apps.
#pragma once

#include <filesystem>

#include "photocoag/core/descriptor.hpp"

namespace photocoag {

/// Throws Error if `folder` exists and is not an empty folder. Creates nothing.
void check_run_folder(const std::filesystem::path& folder);

/// A new or empty output folder, owned by this object: of several processes that claim it at once,
/// one succeeds. The claim ends with the object, and a folder that it created and that is still
/// empty is removed. Once there are files, no other run can claim it.
class ClaimedFolder {
 public:
  /// Creates the folder and its parents if necessary. Throws Error naming --out.
  explicit ClaimedFolder(std::filesystem::path folder);
  /// Creates the first of base, base-2, base-3, … that does not exist. Throws Error naming --out.
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
