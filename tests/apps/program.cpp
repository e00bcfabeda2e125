#include "apps/program.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace photocoag::testing {

namespace fs = std::filesystem;

std::string read_all(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_all(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

Sandbox::Sandbox() {
  std::string name = (fs::temp_directory_path() / "photocoag-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  folder_ = name;
  fs::create_directory(folder_ / ".said");
}

Sandbox::~Sandbox() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

ProgramResult Sandbox::run(const std::string& arguments, const std::string& before) const {
  const std::string said = (folder_ / ".said").string();
  const std::string command = "cd '" + folder_.string() + "' && XDG_CACHE_HOME='" +
                              folder_.string() + "/.cache' " + before +
                              " '" PHOTOCOAG_PROGRAM "' " + arguments + " >'" + said + "/out' 2>'" +
                              said + "/err' </dev/null";
  const int status = std::system(command.c_str());
  ProgramResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = read_all(folder_ / ".said" / "out");
  result.err = read_all(folder_ / ".said" / "err");
  return result;
}

std::size_t Sandbox::entries() const {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    if (name != ".said" && name != ".cache") ++count;
  }
  return count;
}

}  // namespace photocoag::testing
