// Sessions for tests: text of their files.
#pragma once

#include <string>

namespace photocoag::testing {

/// Three spots of a coarse simulated eye in virtual time.
inline std::string small_session(const std::string& session = "", const std::string& more = "") {
  return "[session]\n"
         "set = [\"grid.min_cells=2000\", \"run.duration_ms=20\"]\n"
         "pacing = \"virtual\"\n" +
         session +
         "[[spot]]\nname = \"A\"\n"
         "[[spot]]\nname = \"B\"\nx_um = 300\nreference_K = 20\nhold_ms = 5\n"
         "[[spot]]\nname = \"C\"\ny_um = -200\nset = [\"plant.absorption_factor=0.5\"]\n" +
         more;
}

}  // namespace photocoag::testing
