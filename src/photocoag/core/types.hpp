// Role: online and offline; Eigen types with a compile-time bound, so that they live on the stack
// or inside their owner, never on the heap. Code that includes this links only if Eigen has the
// library's memory layout, which photocoag's CMake targets ensure.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "photocoag looks for NaN and infinity: no -ffast-math, -Ofast or -ffinite-math-only"
#endif

namespace photocoag {

inline constexpr int kMaxOrder = 14;                // states of a reduced model
inline constexpr int kMaxHorizon = 50;              // N
inline constexpr int kMaxInputs = kMaxHorizon - 1;  // free powers u_0 … u_{N-2}

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Capacities are rounded up to even numbers of doubles, so that every object is aligned to 16
// bytes: otherwise the start of Eigen's vectorised sums, and with it the last bit of a result,
// would depend on the address.
constexpr int even(int capacity) { return capacity + capacity % 2; }

template <int Max>
using BoundedVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, even(Max), 1>;
template <int MaxRows, int MaxCols>
using BoundedMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                    even(MaxRows), even(MaxCols)>;

using StateVector = BoundedVector<kMaxOrder>;
using StateMatrix = BoundedMatrix<kMaxOrder, kMaxOrder>;
using InputVector = BoundedVector<kMaxInputs>;
using InputMatrix = BoundedMatrix<kMaxInputs, kMaxInputs>;

static_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == 16 && EIGEN_DEFAULT_ALIGN_BYTES == 64 &&
                  EIGEN_MALLOC_ALREADY_ALIGNED == 0,
              "Eigen's alignment is not the library's: link photocoag's CMake targets, or compile "
              "with the EIGEN_ definitions of photocoag_base");
static_assert(alignof(StateMatrix) == 16 && alignof(InputVector) == 16);

/// What the layout of public types depends on: compiler flags and Eigen's version.
template <int EigenWorld, int EigenMajor, int EigenMinor, std::size_t SizeOfIndex,
          std::size_t SizeOfState, std::size_t SizeOfVector>
struct Layout {
  static const char kIsTheLibrarys;  // defined in types.cpp for the library's own, for no other
};
using LayoutHere = Layout<EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION,
                          sizeof(Eigen::Index), sizeof(StateVector), sizeof(std::vector<double>)>;
/// Undefined for any other layout than the library's: the program then does not link.
[[gnu::used]] inline const char* const kLayoutChecked = &LayoutHere::kIsTheLibrarys;

}  // namespace photocoag
