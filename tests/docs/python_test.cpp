// The Python of docs/realtime.md, run on a treatment made as the document says.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "docs/documents.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

int shell(const std::string& folder, const std::string& command, std::string& output) {
  std::FILE* pipe = popen(("cd '" + folder + "' && " + command + " 2>&1 </dev/null").c_str(), "r");
  if (pipe == nullptr) return -1;
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(DocumentedPython, RunsOnAFreshTreatment) {
  const TemporaryFolder folder;
  std::string said;
  if (shell(folder.path().string(), "python3 -c 'import json'", said) != 0) {
    GTEST_SKIP() << "no Python here";
  }
  // A busy machine may overrun and stop: the log is there all the same.
  const std::string program = "'" PHOTOCOAG_PROGRAM "' ";
  ASSERT_LE(shell(folder.path().string(),
                  program + "treat --out runs/first --set grid.min_cells=2000 --set "
                            "run.duration_ms=50",
                  said),
            1)
      << said;
  ASSERT_EQ(shell(folder.path().string(), program + "convert runs/first --hdf5 first.h5", said), 0)
      << said;
  // One program per import of something: the second block needs h5py.
  const std::string document = text_of(source_folder() / "docs" / "realtime.md");
  std::vector<std::string> programs;
  for (const std::string& line : lines_of(document, true, "python")) {
    if (line.rfind("import ", 0) == 0) programs.emplace_back();
    ASSERT_FALSE(programs.empty());
    programs.back() += line + "\n";
  }
  ASSERT_EQ(programs.size(), 2u);
  for (std::size_t k = 0; k < programs.size(); ++k) {
    const std::string file = folder.file("program" + std::to_string(k) + ".py");
    std::ofstream(file) << programs[k];
    if (k == 1 && shell(folder.path().string(), "python3 -c 'import h5py'", said) != 0) continue;
    std::string output;
    EXPECT_EQ(shell(folder.path().string(), "python3 '" + file + "'", output), 0) << output;
    EXPECT_NE(output.find("cycles"), std::string::npos) << output;
  }
}

}  // namespace
}  // namespace photocoag::testing
