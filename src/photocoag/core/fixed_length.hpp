// Role: online; compile-time loop lengths for the most frequent sizes. Used by qp, mpc, estimation,
// safety. Sums run in the same order with a fixed and a variable length, so the results are
// bit-identical. Real time: noexcept, no heap.
#pragma once

#include <type_traits>

// Put before a loop whose length may be a constant: full unrolling beats vectorization in
// triangular loops.
#if defined(__clang__)
#define PHOTOCOAG_UNROLLED _Pragma("unroll 9")
#elif defined(__GNUC__)
#define PHOTOCOAG_UNROLLED _Pragma("GCC unroll 9")
#else
#define PHOTOCOAG_UNROLLED
#endif

namespace photocoag {

/// work(length), where length is std::integral_constant<int, n> if n is among `Lengths`, else the
/// int n. Write `const int m = length;`.
template <int First, int... Lengths, typename Work>
inline auto for_length(int n, const Work& work) noexcept {
  if (n == First) return work(std::integral_constant<int, First>{});
  if constexpr (sizeof...(Lengths) > 0) {
    return for_length<Lengths...>(n, work);
  } else {
    return work(n);
  }
}

}  // namespace photocoag
