// Any bytes as a configuration: refused with an Error, or read, printed and read again as the same.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"

namespace {

photocoag::Config load_bytes(const void* bytes, std::size_t size) {
  static const int file = memfd_create("config", MFD_CLOEXEC);
  static const std::string name = "/proc/self/fd/" + std::to_string(file);
  if (ftruncate(file, 0) != 0 || pwrite(file, bytes, size, 0) != static_cast<ssize_t>(size)) {
    std::abort();
  }
  return photocoag::load_config(name, {});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  try {
    const photocoag::Config config = load_bytes(bytes, size);
    const std::string text = photocoag::to_toml(config);
    if (photocoag::to_toml(load_bytes(text.data(), text.size())) != text) std::abort();
  } catch (const photocoag::Error&) {
    // Refused, as it should be.
  }
  return 0;
}
