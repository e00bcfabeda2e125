// Decompositions in long double that only a reference for tests and benchmarks asks for.
#include <Eigen/LU>

#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

LongVector solve_rank_revealing(const LongMatrix& A, const LongVector& b, long double threshold) {
  Eigen::FullPivLU<LongMatrix> lu(A);
  lu.setThreshold(threshold);
  LongVector x = lu.solve(b);
  x += lu.solve(b - A * x);
  return x;
}

}  // namespace photocoag
