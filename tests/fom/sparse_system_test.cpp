// The sparse matrices against the dense operator, which is assembled from the balance of heat.
#include <gtest/gtest.h>

#include "fom/dense_operator.hpp"
#include "photocoag/fom/sparse_system.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

// Both are sums of at most five products of the same numbers, and the functionals pass through the
// orthogonal modes and back: some hundred roundings.
constexpr double kRounding = 1e-11;

TEST(SparseSystem, IsTheBalanceOfHeat) {
  for (const Tissue& tissue :
       {Tissue{}, testing::normalized(Tissue{}), testing::layered(), testing::gaussian(Tissue{})}) {
    const FullOrderModel model(tissue, testing::small_grid());
    const SparseSystem system = assemble_sparse_system(model);
    for (const double alpha : {0.5, 1.1}) {
      const testing::DenseOperator dense = testing::dense_operator(tissue, model.grid(), alpha);
      const Eigen::MatrixXd A = system.E.cwiseInverse().asDiagonal() * Eigen::MatrixXd(system.A);
      EXPECT_LT((A - dense.A).norm(), kRounding * dense.A.norm());
      EXPECT_LT((input_of_cells(model, alpha) - dense.B).norm(), kRounding * dense.B.norm());
      EXPECT_LT((peak_of_cells(model) - dense.C_peak.transpose()).norm(),
                kRounding * dense.C_peak.norm());
      EXPECT_LT((volume_of_cells(model, alpha) - dense.C_volume.transpose()).norm(),
                kRounding * dense.C_volume.norm());
    }
    EXPECT_EQ((Eigen::MatrixXd(system.A) - Eigen::MatrixXd(system.A).transpose()).norm(), 0.0)
        << "symmetric to the last bit: each face has one conductance";
  }
}

}  // namespace
}  // namespace photocoag
