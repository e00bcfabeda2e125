// Role: online and offline; Eigen types with a bound known at compile time, so that they live on
// the stack or inside their owner and never on the heap.
#pragma once

#include <Eigen/Core>

namespace photocoag {

inline constexpr int kMaxOrder = 14;                // states of a reduced model
inline constexpr int kMaxHorizon = 50;              // N
inline constexpr int kMaxInputs = kMaxHorizon - 1;  // free powers u_0 … u_{N-2}

// Capacities are rounded up to even numbers of doubles, so that every object is aligned to 16
// bytes: where Eigen starts a vectorised sum would otherwise depend on the address, and with it the
// last bit of the result.
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

}  // namespace photocoag
