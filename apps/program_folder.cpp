#include "full_program.hpp"

namespace photocoag {

namespace fs = std::filesystem;

fs::path find_from_program(std::initializer_list<const char*> places, int above) {
  fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  for (int level = 0; level <= above && folder.has_relative_path(); ++level) {
    for (const char* place : places) {
      if (fs::exists(folder / place)) return folder / place;
    }
    folder = folder.parent_path();
  }
  return {};
}

}  // namespace photocoag
