// Role: tests; counts what the calling thread asks of the heap, in the build that ships.
// Method: the test program defines malloc and its relatives and every form of operator new and
// delete itself and forwards to glibc, so that calls from inside shared libraries count as well.
// Under the address, thread and realtime sanitizers, which bring their own malloc, only operator
// new and delete are counted. tests/CMakeLists.txt links it into every test program. It can also
// refuse an allocation.
#pragma once

namespace photocoag::testing {

struct HeapUse {
  long allocations = 0;  ///< malloc, calloc, realloc, aligned forms, operator new
  long frees = 0;        ///< free and operator delete of something, not of nullptr

  bool operator==(const HeapUse&) const = default;
};

/// False where malloc cannot be replaced (sanitizers, other C libraries): operator new only.
bool heap_guard_sees_malloc() noexcept;

/// Counts on the constructing thread for as long as it lives. One at a time per thread.
class HeapGuard {
 public:
  HeapGuard() noexcept;
  ~HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;

  /// Since construction. Read it before any assertion: GoogleTest allocates.
  HeapUse use() const noexcept;
};

/// While it lives, the constructing thread's `number`-th allocation (from 1) is refused: malloc
/// gives nullptr, operator new throws std::bad_alloc.
class RefusedAllocation {
 public:
  explicit RefusedAllocation(long number) noexcept;
  ~RefusedAllocation();
  RefusedAllocation(const RefusedAllocation&) = delete;
  RefusedAllocation& operator=(const RefusedAllocation&) = delete;

  /// Was there such an allocation?
  bool met() const noexcept;
};

}  // namespace photocoag::testing
