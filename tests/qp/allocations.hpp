// Role: tests; counts heap allocations of the calling thread, in every build but those with a
// sanitizer (which bring their own malloc).
#pragma once

namespace photocoag::qp_exam {

/// False where allocations cannot be counted.
bool can_count_allocations() noexcept;

/// Counts malloc, calloc, realloc, aligned forms and operator new from its construction on.
class AllocationCounter {
 public:
  AllocationCounter() noexcept;
  ~AllocationCounter();
  AllocationCounter(const AllocationCounter&) = delete;
  AllocationCounter& operator=(const AllocationCounter&) = delete;
  long count() const noexcept;
};

}  // namespace photocoag::qp_exam
