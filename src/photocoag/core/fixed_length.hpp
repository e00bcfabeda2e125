// Role: online; loops whose length the compiler knows, for the lengths that occur most. Used by qp,
// estimation. A sum runs in the same order at either kind of length: the bits are the same. Real
// time: noexcept, no heap.
#pragma once

#include <type_traits>

// Before a loop of a length that may be known: then it is written out, which beats vectors where
// the next loop starts one further.
#if defined(__clang__)
#define PHOTOCOAG_UNROLLED _Pragma("unroll 9")
#elif defined(__GNUC__)
#define PHOTOCOAG_UNROLLED _Pragma("GCC unroll 9")
#else
#define PHOTOCOAG_UNROLLED
#endif

namespace photocoag {

/// work(length), where length is std::integral_constant<int, n> if n is among `Lengths`, else the
/// int n: `const int m = length;` is then a constant, or not.
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
