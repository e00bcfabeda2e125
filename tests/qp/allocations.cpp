#include "qp/allocations.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace photocoag::qp_exam {
namespace {
// constinit: reading it must not itself allocate or run an initializer.
constinit thread_local bool counting = false;
constinit thread_local long allocations = 0;
}  // namespace

AllocationCounter::AllocationCounter() noexcept {
  allocations = 0;
  counting = true;
}
AllocationCounter::~AllocationCounter() { counting = false; }
long AllocationCounter::count() const noexcept { return allocations; }

}  // namespace photocoag::qp_exam

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace photocoag::qp_exam {
bool can_count_allocations() noexcept { return true; }
static void note() noexcept {
  if (counting) ++allocations;
}
}  // namespace photocoag::qp_exam

using photocoag::qp_exam::note;

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  note();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note();
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  note();
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t size) {
  note();
  *result = __libc_memalign(alignment, size);
  return *result != nullptr ? 0 : ENOMEM;
}
}

// Counted on its own as well: a linked allocator might serve operator new without malloc.
void* operator new(std::size_t size) {
  note();
  if (void* result = __libc_malloc(size)) return result;
  throw std::bad_alloc();
}
void operator delete(void* pointer) noexcept { std::free(pointer); }
void operator delete(void* pointer, std::size_t) noexcept { std::free(pointer); }

#else

namespace photocoag::qp_exam {
bool can_count_allocations() noexcept { return false; }
}  // namespace photocoag::qp_exam

#endif
