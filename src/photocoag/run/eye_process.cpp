#include "photocoag/run/eye_process.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <random>
#include <thread>

#include "photocoag/rt/eye_socket.hpp"
#include "photocoag/run/device_address.hpp"

namespace photocoag {

namespace {

bool answers(const std::string& socket) {
  try {
    close(connect_to(socket, 0));
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

EyeProcess::EyeProcess(const std::filesystem::path& config_file,
                       const std::vector<std::string>& arguments, bool once)
    : once_(once) {
  // An abstract name: no folder, nothing left behind by a killed program.
  std::random_device random;
  socket_ = fmt::format("@photocoag-eye-{}-{:08x}{:08x}", getpid(), random(), random());
  std::vector<std::string> words = {"photocoag", "eye",   "--config", config_file.string(),
                                    "--socket",  socket_, "--owner",  std::to_string(getpid())};
  if (once) words.emplace_back("--once");
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t id = -1;
  if (posix_spawn(&id, "/proc/self/exe", nullptr, nullptr, argv.data(), environ) != 0) {
    throw DeviceError(ErrorParts{.where = "eye", .problem = "its process cannot be started"});
  }
  id_ = id;
  constexpr int kPatience = 3000;  // times 10 ms
  for (int i = 0; i < kPatience; ++i) {
    if (answers(socket_)) return;
    int status = 0;
    if (waitpid(id_, &status, WNOHANG) == id_) {
      id_ = -1;
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw DeviceError(ErrorParts{.where = "eye", .problem = "its process has not come up"});
}

EyeProcess::~EyeProcess() {
  constexpr int kPatience = 300;  // times 10 ms
  if (!once_ && id_ > 0) kill(id_, SIGTERM);
  for (int i = 0; i < kPatience && id_ > 0; ++i) {
    int status = 0;
    if (waitpid(id_, &status, WNOHANG) == id_) id_ = -1;
    if (id_ > 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (id_ > 0) {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
}

}  // namespace photocoag
