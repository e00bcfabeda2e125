#include "photocoag/rt/sealed_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "photocoag/core/error.hpp"

namespace photocoag {

void Unmap::operator()(const void* memory) const noexcept {
  munmap(const_cast<void*>(memory), size);
}

namespace detail {
namespace {

constexpr int kSizeSeals = F_SEAL_SHRINK | F_SEAL_GROW;

[[noreturn]] void refuse_memory(int descriptor) {
  const int reason = errno;
  if (descriptor >= 0) close(descriptor);
  throw Error(ErrorParts{
      .where = "shared memory", .problem = "cannot be made", .found = std::strerror(reason)});
}

}  // namespace

void* make_sealed(std::size_t size, Access others, int& descriptor) {
  descriptor = memfd_create("photocoag-eye", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (descriptor < 0 || ftruncate(descriptor, static_cast<off_t>(size)) != 0)
    refuse_memory(descriptor);
  void* memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (memory == MAP_FAILED) refuse_memory(descriptor);
  // This mapping stays writable; no later one is.
  const int seals = kSizeSeals | F_SEAL_SEAL | (others == Access::kRead ? F_SEAL_FUTURE_WRITE : 0);
  if (fcntl(descriptor, F_ADD_SEALS, seals) != 0) {
    munmap(memory, size);
    refuse_memory(descriptor);
  }
  return memory;
}

void* map_sealed(int descriptor, std::size_t size, Access access) noexcept {
  if (descriptor < 0) return nullptr;
  struct stat file {};
  const int seals = fcntl(descriptor, F_GET_SEALS);
  const bool safe = seals >= 0 && (seals & F_SEAL_SHRINK) != 0 && fstat(descriptor, &file) == 0 &&
                    file.st_size >= static_cast<off_t>(size);
  const int protection = access == Access::kRead ? PROT_READ : PROT_READ | PROT_WRITE;
  void* memory = safe ? mmap(nullptr, size, protection, MAP_SHARED, descriptor, 0) : MAP_FAILED;
  close(descriptor);
  return memory == MAP_FAILED ? nullptr : memory;
}

void* map_private(std::size_t size) {
  void* memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) refuse_memory(-1);
  return memory;
}

}  // namespace detail
}  // namespace photocoag
