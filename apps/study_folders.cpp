#include "study_folders.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

#include "full_program.hpp"

namespace photocoag {

namespace fs = std::filesystem;

fs::path shipped_studies() {
  const fs::path plan =
      find_from_program({"share/photocoag/studies/plan.toml", "studies/plan.toml"}, 8);
  return plan.empty() ? fs::path("studies") : plan.parent_path();
}

ClaimedFolder output_folder(const std::string& out, const std::string& name) {
  if (!out.empty()) return ClaimedFolder(out);
  return ClaimedFolder::next_after(
      fs::path("runs") / fmt::format("{}-{:%Y%m%d-%H%M%S}", name, fmt::gmtime(std::time(nullptr))));
}

}  // namespace photocoag
