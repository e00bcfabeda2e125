// Eigen's memory crosses the border between library and program in both directions.
#include <Eigen/Dense>
#include <cmath>
#include <photocoag/rom/discretize.hpp>

int main() {
  double error = 0.0;
  for (int n = 1; n <= 64; ++n) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Random(n, n);
    photocoag::DiscretePair pair =
        photocoag::discretize(A, 1e-3, photocoag::Discretization::kZeroOrderHold);
    pair.transition = pair.transition * A;  // of another size of vectors than the library's
    pair.input.resize(2 * n, n);            // gives the library's memory back
    error += std::abs(pair.transition.sum() - A.sum()) / n / n;
  }
  return error < 1.0 ? 0 : 1;
}
