#include "support/heap_guard.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "photocoag/core/real_time.hpp"

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PHOTOCOAG_FOREIGN_MALLOC 1
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PHOTOCOAG_FOREIGN_MALLOC 1
#endif
#if defined(__GLIBC__) && !defined(PHOTOCOAG_FOREIGN_MALLOC) && !PHOTOCOAG_RTSAN
#define PHOTOCOAG_REPLACE_MALLOC 1
#else
#define PHOTOCOAG_REPLACE_MALLOC 0
#endif

namespace photocoag::testing {
namespace {

// constinit: touching them inside malloc must not itself allocate or run an initializer.
constinit thread_local bool armed = false;
constinit thread_local HeapUse counted;
constinit thread_local long until_refused = 0;  // 0: none is refused

// False: this one is refused.
bool note_allocation() noexcept {
  if (armed) ++counted.allocations;
  return until_refused == 0 || --until_refused != 0;
}

void note_free(const void* pointer) noexcept {
  if (armed && pointer != nullptr) ++counted.frees;
}

}  // namespace

bool heap_guard_sees_malloc() noexcept { return PHOTOCOAG_REPLACE_MALLOC != 0; }

HeapGuard::HeapGuard() noexcept {
  counted = {};
  armed = true;
}
HeapGuard::~HeapGuard() { armed = false; }
HeapUse HeapGuard::use() const noexcept { return counted; }

RefusedAllocation::RefusedAllocation(long number) noexcept { until_refused = number; }
RefusedAllocation::~RefusedAllocation() { until_refused = 0; }
bool RefusedAllocation::met() const noexcept { return until_refused == 0; }

}  // namespace photocoag::testing

using photocoag::testing::note_allocation;
using photocoag::testing::note_free;

#if PHOTOCOAG_REPLACE_MALLOC

extern "C" {
void* __libc_malloc(std::size_t size) noexcept;
void* __libc_calloc(std::size_t count, std::size_t size) noexcept;
void* __libc_realloc(void* old, std::size_t size) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t size) noexcept;
void* __libc_valloc(std::size_t size) noexcept;
void __libc_free(void* pointer) noexcept;

void* malloc(std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
  return __libc_realloc(old, size);
}
void free(void* pointer) noexcept {
  note_free(pointer);
  __libc_free(pointer);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
  return __libc_memalign(alignment, size);
}
void* valloc(std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
  return __libc_valloc(size);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t size) noexcept {
  if (!note_allocation()) return ENOMEM;
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0) {
    return EINVAL;
  }
  void* block = __libc_memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *result = block;
  return 0;
}
}  // extern "C"

#endif

namespace {

// Not through the replaced malloc: one request counts once.
void* take(std::size_t size) noexcept {
  if (!note_allocation()) return nullptr;
#if PHOTOCOAG_REPLACE_MALLOC
  return __libc_malloc(size);
#else
  return std::malloc(size);
#endif
}

void* take(std::size_t size, std::align_val_t alignment) noexcept {
  if (!note_allocation()) return nullptr;
  const auto align = static_cast<std::size_t>(alignment);
#if PHOTOCOAG_REPLACE_MALLOC
  return __libc_memalign(align, size);
#else
  return std::aligned_alloc(align, (size + align - 1) / align * align);
#endif
}

void* or_throw(void* block) {
  if (block == nullptr) throw std::bad_alloc();
  return block;
}

void give_back(void* pointer) noexcept {
  note_free(pointer);
#if PHOTOCOAG_REPLACE_MALLOC
  __libc_free(pointer);
#else
  std::free(pointer);
#endif
}

}  // namespace

using Size = std::size_t;
using Align = std::align_val_t;
using NoThrow = std::nothrow_t;

void* operator new(Size size) { return or_throw(take(size)); }
void* operator new[](Size size) { return or_throw(take(size)); }
void* operator new(Size size, const NoThrow&) noexcept { return take(size); }
void* operator new[](Size size, const NoThrow&) noexcept { return take(size); }
void* operator new(Size size, Align align) { return or_throw(take(size, align)); }
void* operator new[](Size size, Align align) { return or_throw(take(size, align)); }
void* operator new(Size size, Align align, const NoThrow&) noexcept { return take(size, align); }
void* operator new[](Size size, Align align, const NoThrow&) noexcept { return take(size, align); }

void operator delete(void* pointer) noexcept { give_back(pointer); }
void operator delete[](void* pointer) noexcept { give_back(pointer); }
void operator delete(void* pointer, Size) noexcept { give_back(pointer); }
void operator delete[](void* pointer, Size) noexcept { give_back(pointer); }
void operator delete(void* pointer, const NoThrow&) noexcept { give_back(pointer); }
void operator delete[](void* pointer, const NoThrow&) noexcept { give_back(pointer); }
void operator delete(void* pointer, Align) noexcept { give_back(pointer); }
void operator delete[](void* pointer, Align) noexcept { give_back(pointer); }
void operator delete(void* pointer, Size, Align) noexcept { give_back(pointer); }
void operator delete[](void* pointer, Size, Align) noexcept { give_back(pointer); }
void operator delete(void* pointer, Align, const NoThrow&) noexcept { give_back(pointer); }
void operator delete[](void* pointer, Align, const NoThrow&) noexcept { give_back(pointer); }
